// The renderer's public face. It knows scenes, files and pixels; nothing of jobs or networks.
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
#include "common/image/frame.h"
#include "common/image/health.h"
#include "common/image/rounds.h"
#include "common/job/settings.h"
#include "common/scene/scene.h"

namespace ls::render {

class World;
using ls::Health;

// Where the bytes of the scene's assets lie on this machine.
using AssetFiles = std::map<Digest, std::filesystem::path>;

// Builds BVH, grids and light tables. invalid_argument: the scene or one of its files is at fault, and the
// message says which and why; resource_exhausted: a limit. Deterministic for any `threads`.
Result<std::shared_ptr<const World>> build_world(const Scene& scene, const RenderSettings& settings,
                                                 const AssetFiles& files, int threads);

// Where the renderer is, for whoever must explain its death. Written with relaxed stores.
struct Breadcrumb {
  std::atomic<std::int32_t> x{-1}, y{-1};
  std::atomic<std::uint64_t> sample{0};
};

struct TileResult {
  std::vector<float> sums;  // planes, see common/image/partial.h: six, and those of the settings' AOVs
  Health health;            // of the samples, by cause and pixel; not of the inputs
  bool stopped = false;     // `stop` was seen: sums are not valid
};

// Renders the sample range of a tile, on the calling thread. A pure function of (world, tile, samples).
TileResult render_tile(const World& world, PixelRect tile, SampleRange samples, const std::atomic<bool>* stop,
                       Breadcrumb* breadcrumb);

// The integrator variants that cover the world, cheapest first, and rendering with one of them: all give the
// same bits.
std::vector<std::string> covering_variants(const World& world);
std::vector<std::string> all_variants(const World& world);  // of the world's integrator
TileResult render_tile_as(const World& world, const std::string& variant, PixelRect tile,
                          SampleRange samples);

// One sample of one pixel, for replay: its radiance, and what was wrong with it.
struct SampleValue {
  double rgb[3];
  bool finite;    // false: it is rejected
  Health health;  // of this sample alone
};
SampleValue render_sample(const World& world, int x, int y, std::uint64_t sample);

// What the scene makes us use and leave out, in words; and the bytes of each structure.
struct WorldReport {
  struct Structure {
    std::string name;
    std::uint64_t bytes = 0;
    std::string detail;  // "12 triangles"; or, where there are no bytes, why not
  };
  std::vector<std::string> used, left_out;
  std::vector<Structure> structures;
  std::string variant;  // the integrator instantiation, one of `variants` that there are
  std::size_t variants = 0;
  // Negative densities and texels set to 0, degenerate triangles dropped, ...
  std::uint64_t clamped_inputs = 0;
};
// The same by cause.
const Health& changed_inputs(const World& world);
WorldReport describe(const World& world);

// SHA-256 of the build and a start-up battery: machines of one class give the same bits. Computed once.
const Digest& numeric_class();

}  // namespace ls::render
