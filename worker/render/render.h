// The renderer's public interface. It knows scenes, files and pixels, but nothing of jobs or networks.
#pragma once

#include <atomic>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "common/base/digest.h"
#include "common/base/error.h"
#include "common/image/film/health.h"
#include "common/image/frame/frame.h"
#include "common/image/frame/rounds.h"
#include "common/job/settings.h"
#include "common/scene/scene.h"

namespace ls::render {

class World;
using ls::Health;

// Local file of each of the scene's assets, by digest.
using AssetFiles = std::map<Digest, std::filesystem::path>;

// Builds BVH, grids and light tables; deterministic for any `threads`.
// invalid_argument: the scene or one of its files is at fault (the message names which and why);
// resource_exhausted: a limit is exceeded.
Result<std::shared_ptr<const World>> build_world(const Scene& scene, const RenderSettings& settings,
                                                 const AssetFiles& files, int threads);

// The sample being rendered, for crash reports. Written with relaxed stores.
struct Breadcrumb {
  std::atomic<std::int32_t> x{-1}, y{-1};
  std::atomic<std::uint64_t> sample{0};
};

struct TileResult {
  std::vector<float> sums;  // planes as in common/image/film/partial.h: six, plus those of the requested AOVs
  Health health;            // of the samples, by cause and pixel; inputs are not included
  bool stopped = false;     // `stop` was set: sums are not valid
};

// Renders a sample range of a tile on the calling thread. A pure function of (world, tile, samples).
TileResult render_tile(const World& world, PixelRect tile, SampleRange samples, const std::atomic<bool>* stop,
                       Breadcrumb* breadcrumb);

// Names of the integrator variants that cover the world, cheapest first. render_tile_as() renders with one of
// them; all give the same bits.
std::vector<std::string> covering_variants(const World& world);
std::vector<std::string> all_variants(const World& world);  // all variants of the world's integrator
TileResult render_tile_as(const World& world, const std::string& variant, PixelRect tile,
                          SampleRange samples);

// The value of one sample of one pixel, for replay.
struct SampleValue {
  double rgb[3];
  bool finite;    // false: the sample is rejected
  Health health;  // of this sample only
};
SampleValue render_sample(const World& world, int x, int y, std::uint64_t sample);

// The features that the scene uses and leaves out, in words, and the size of each structure.
struct WorldReport {
  struct Structure {
    std::string name;
    std::uint64_t bytes = 0;
    std::string detail;  // "12 triangles"; if bytes is 0, the reason
  };
  std::vector<std::string> used, left_out;
  std::vector<Structure> structures;
  std::string variant;  // the chosen integrator instantiation, out of `variants` compiled ones
  std::size_t variants = 0;
  // Inputs that were corrected: negative densities and texels set to 0, degenerate triangles dropped, ...
  std::uint64_t clamped_inputs = 0;
};
// The corrected inputs by cause.
const Health& changed_inputs(const World& world);
WorldReport describe(const World& world);

// SHA-256 of the build and of the results of a start-up battery: machines of the same class produce the same
// bits. Computed once.
const Digest& numeric_class();

}  // namespace ls::render
