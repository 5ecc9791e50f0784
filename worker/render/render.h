// The renderer's public interface. It handles scenes, files and pixels, but not jobs or networks.
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
#include "common/job/techniques.h"
#include "common/scene/scene.h"

namespace ls::render {

class World;
using ls::Health;

// The local file of each asset of a scene (mesh, image, volume). The key is the asset's digest.
using AssetFiles = std::map<Digest, std::filesystem::path>;

// Prepares the scene for rendering: builds the BVH, grids and light tables. The result does not depend on
// `threads`, the number of threads that it uses. Fails with invalid_argument if the scene or one of its files
// is at fault (the message names which and why), and with resource_exhausted if a limit is exceeded.
Result<std::shared_ptr<const World>> build_world(const Scene& scene, const RenderSettings& settings,
                                                 const AssetFiles& files, int threads);

// Limits TBB, the library under Embree and OpenVDB, to `threads` threads in this process as long as the
// returned object lives. Embree's own setting does not limit the threads that TBB starts while a world is
// built. If several such objects live, the lowest limit applies.
std::shared_ptr<void> limit_threads(int threads);

// The pixel and index of the sample that a thread renders, for crash reports. With path reuse (path_reuse.h)
// the thread renders a square of 16 x 16 pixels together, and the pixel is one of these. The thread writes
// with relaxed stores.
struct Breadcrumb {
  std::atomic<std::int32_t> x{-1}, y{-1};
  std::atomic<std::uint64_t> sample{0};
};

struct TileResult {
  std::vector<float> sums;  // planes as in common/image/film/partial.h: six, plus those of the requested AOVs
  // The number of bad samples by cause, and where they are; corrected inputs of the scene are not included
  Health health;
  bool stopped = false;  // true if render_tile() stopped early: the sums are then not valid
};

// Renders the samples with the indices `samples` of each pixel of `tile` on the calling thread. The result is
// a pure function of (world, tile, samples), unless `stop` becomes true. `breadcrumb` receives the sample
// that is being rendered.
TileResult render_tile(const World& world, PixelRect tile, SampleRange samples, const std::atomic<bool>* stop,
                       Breadcrumb* breadcrumb);

// Returns the side, in pixels, of the squares of pixels that share the tails of their paths (path_reuse.h),
// or 1 if the world does not use path reuse. A tile that consists of whole squares traces no paths of pixels
// of other tiles.
int tile_alignment(const World& world);

// Returns the names of the integrator variants that can render this world, cheapest first. A variant is the
// integrator compiled for one set of features (features.h). render_tile_as() renders with one of them; all
// give the same bits.
std::vector<std::string> covering_variants(const World& world);
std::vector<std::string> all_variants(const World& world);  // all variants of the world's integrator
TileResult render_tile_as(const World& world, const std::string& variant, PixelRect tile,
                          SampleRange samples);

// The result of render_sample(), which renders a single sample of a pixel, so that a sample of an image can
// be rendered again.
struct SampleValue {
  double rgb[3];
  bool finite;    // false if the sample is rejected
  Health health;  // the problems of this sample, by cause
};
SampleValue render_sample(const World& world, int x, int y, std::uint64_t sample);

// The techniques that the world's integrator uses.
TechniqueSet techniques_of(const World& world);

// A report for people: the names of the features that the scene uses and of those it does not use, and the
// size of each data structure.
struct WorldReport {
  struct Structure {
    std::string name;
    std::uint64_t bytes = 0;
    std::string detail;  // for example "12 triangles"; if bytes is 0, the reason for it
  };
  std::vector<std::string> used, left_out;
  std::vector<Structure> structures;
  std::string variant;  // name of the chosen variant, out of `variants` compiled ones
  std::size_t variants = 0;
  // The number of inputs that were corrected: negative densities and texels set to 0, degenerate triangles
  // dropped, and so on.
  std::uint64_t clamped_inputs = 0;
};
// Returns how many inputs of the scene were corrected, by cause.
const Health& changed_inputs(const World& world);
WorldReport describe(const World& world);

// Returns the numeric class of this machine and build: the SHA-256 of the build id and of the results of a
// battery of test computations. These run once, at the first call. Machines of the same class produce the
// same bits.
const Digest& numeric_class();
// Describes the machine and build of the class for people: "armv8-a:gcc-14.2.0:embree-4.3.3". Different
// classes may have the same description.
const std::string& platform();

}  // namespace ls::render
