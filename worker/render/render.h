// The renderer's public interface. It handles scenes, files and pixels, but not jobs or networks.
#pragma once

#include <atomic>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "core/base/digest.h"
#include "core/base/error.h"
#include "core/image/film/health.h"
#include "core/image/frame/frame.h"
#include "core/image/frame/rounds.h"
#include "core/job/settings.h"
#include "core/job/techniques.h"
#include "core/scene/scene.h"

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

// The sample that a thread is rendering, for crash reports: its pixel (-1: none yet) and its index among the
// pixel's samples. With path reuse (path_reuse.h) a thread renders squares of 16 x 16 pixels as a whole, and
// x and y are those of some pixel of the square. The thread writes with relaxed atomic stores.
struct Breadcrumb {
  std::atomic<std::int32_t> x{-1}, y{-1};
  std::atomic<std::uint64_t> sample{0};
};

struct TileResult {
  // The tile's planes, as in Partial::sums (core/image/film/partial.h): six of colour, then those of the
  // requested AOVs
  std::vector<float> sums;
  // The problems of samples, by cause: their number, and the pixels and samples at which they occurred.
  // Corrected inputs of the scene are not included.
  Health health;
  bool stopped = false;  // true if `stop` ended render_tile() early: `sums` is then not valid
};

// Renders the samples with the indices `samples` of each pixel of `tile` on the calling thread. The result is
// a pure function of (world, tile, samples), unless `*stop` becomes true, which ends rendering early.
// `breadcrumb` receives the sample that is being rendered.
TileResult render_tile(const World& world, PixelRect tile, SampleRange samples, const std::atomic<bool>* stop,
                       Breadcrumb* breadcrumb);

// Returns the side, in pixels, of the squares of pixels whose paths share their tails (path_reuse.h), or 1 if
// the world does not use path reuse. If a tile consists of whole squares, rendering it traces paths of its
// own pixels only.
int tile_alignment(const World& world);

// Returns the names of the integrator variants that can render this world, cheapest first. A variant is the
// integrator compiled for one set of features (features.h). render_tile_as() renders with one of them; all
// give the same bits.
std::vector<std::string> covering_variants(const World& world);
// Names of all variants of the world's integrator, including those that cannot render this world
std::vector<std::string> all_variants(const World& world);
TileResult render_tile_as(const World& world, const std::string& variant, PixelRect tile,
                          SampleRange samples);

// The result of render_sample(), which renders one sample of a pixel on its own, so that a sample of an
// earlier image can be rendered again and examined.
struct SampleValue {
  double rgb[3];  // the radiance of the path
  bool finite;    // false if the sample is rejected (for the causes see HealthCause)
  Health health;  // the problems of this sample, by cause
};
SampleValue render_sample(const World& world, int x, int y, std::uint64_t sample);
// The factor from the value of a sample to what the pixel measures, if it belongs to a meter; otherwise 1.
// render_tile() has applied it.
double sample_weight(const World& world, int x, int y);

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
  std::string variant;       // name of the integrator variant that renders this world
  std::size_t variants = 0;  // number of variants of the world's integrator
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
// Describes, for people, what this build is made for and with, as in "armv8-a:gcc-14.2.0:embree-4.3.3".
// Different numeric classes may have the same description.
const std::string& platform();

}  // namespace ls::render
