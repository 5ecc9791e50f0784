// The path tracers with Features::reuse, and which worlds use them. They take long to compile, so they have
// their own source file.
#include <algorithm>
#include <utility>

#include "common/image/error/relative_weights.h"
#include "worker/render/integrator/sharing_block.h"
#include "worker/render/integrator/variant.h"
#include "worker/render/render.h"

namespace ls::render {
namespace {

constexpr Features kAllSplit{.media = true, .chromatic = true, .passing = true, .split = true, .reuse = true};

constexpr int kSharing = 16;  // pixels that share by default

// A few pixels are rendered to find out whether sharing pays, with as many samples as a quick image has: the
// fewer there are, the more of the noise is of edges and soft shadows.
constexpr std::uint64_t kPilotSeed = 0x5eed0f9a7e;
constexpr std::uint64_t kPilotPixels = 256;
constexpr std::uint64_t kPilotSamples = 32;
constexpr int kPilotDepth = 32;  // paths in a white and dense medium have thousands of segments
// Sharing leaves about a quarter of the noise of light that was scattered several times, and all noise of
// other light, in 1.7 times the time (docs/decisions/0036-path-reuse.md). So it pays where the ratio r of all
// noise to that of other light exceeds (1 + (r - 1) / 4) * 1.7, which is from 2.2 on. It is a little less
// here because the ratio rises with the samples: low-discrepancy points help direct light most.
constexpr double kNoiseThatPays = 2;
// With a ratio that is so much larger after a few pixels, the others are not needed.
constexpr std::uint64_t kFirstPilotPixels = 64;
constexpr double kBeyondDoubt = 4;

struct Halves {
  V3d mean[2] = {V3d(0), V3d(0)};
  bool finite = true;
};
Halves two_halves(const World& w, int x, int y) {
  Halves h;
  for (std::uint64_t n = 0; n < kPilotSamples; ++n) {
    const SampleValue v = render_sample(w, x, y, n);
    h.finite = h.finite && v.finite;
    h.mean[n % 2] += V3d(v.rgb[0], v.rgb[1], v.rgb[2]) / (kPilotSamples / 2.);
  }
  return h;
}

// Whether most noise comes from light that was scattered several times. The world is changed meanwhile.
bool sharing_pays(World& w) {
  const std::uint64_t seed = std::exchange(w.seed, kPilotSeed);
  const int max_depth = w.max_depth;
  RandomStream places(kPilotSeed);
  double once = 0, all = 0;  // sums of squared relative errors
  bool finite = true;
  for (std::uint64_t i = 0; i < kPilotPixels; ++i) {
    const int x = static_cast<int>(places.next() % static_cast<std::uint64_t>(w.frame.width)) - w.origin_x;
    const int y = static_cast<int>(places.next() % static_cast<std::uint64_t>(w.frame.height)) - w.origin_y;
    w.max_depth = 2;
    const Halves direct = two_halves(w, x, y);
    w.max_depth = max_depth < 0 ? kPilotDepth : std::min(max_depth, kPilotDepth);
    const Halves whole = two_halves(w, x, y);
    finite = finite && direct.finite && whole.finite;
    for (int c = 0; c < 3; ++c) {
      const double mean = (whole.mean[0][c] + whole.mean[1][c]) / 2;
      const double weight = 1 / (mean * mean + kRelMseDenominator);
      const double of_direct = direct.mean[0][c] - direct.mean[1][c];
      const double of_all = whole.mean[0][c] - whole.mean[1][c];
      once += of_direct * of_direct * weight;
      all += of_all * of_all * weight;
    }
    if (i + 1 == kFirstPilotPixels && all > kBeyondDoubt * kNoiseThatPays * once) break;
  }
  w.seed = seed;
  w.max_depth = max_depth;
  return finite && all > kNoiseThatPays * once;
}

}  // namespace

std::span<const Variant> reuse_variants() {
  static constexpr Variant kVariants[] = {
      group_variant<Features{.passing = true, .reuse = true}>("surfaces, tails shared"),
      group_variant<Features{.media = true, .passing = true, .reuse = true}>(
          "homogeneous grey media, tails shared"),
      group_variant<Features{.media = true, .chromatic = true, .passing = true, .reuse = true}>(
          "homogeneous chromatic media, tails shared"),
  };
  return kVariants;
}

const Variant kReuseSplitVariant =
    group_variant<kAllSplit>("homogeneous media, tails shared, and light in parts");

void share_tails(const IntegratorSettings& settings, World& w) {
  Features need = w.need;
  need.split = false;
  need.reuse = true;
  // Grids have no density of flights in closed form; lamps in media, light vertices and points on segments
  // change how directions are sampled; lights without a position are weighted one by one where rays end.
  if (settings.path_reuse < 0 || settings.path_reuse == 1 || !reuse_variants().back().covers.covers(need))
    return;
  if (w.lights.any_without_place() || w.null_transmission || !w.depth_allows(2)) return;
  // Roulette at the first vertex would be a part of the densities
  if (w.rr_depth < 2 || (w.passing_counts && w.need.passing)) return;
  for (const SurfaceInfo& s : w.geometry.surfaces)
    // Rays from two sides may find different media behind an open boundary. A null surface that emits light
    // is one of several such on a path.
    if ((s.transition && s.sheet) || (s.null && s.light != kNone)) return;
  const bool automatic = settings.path_reuse == 0;
  if (automatic && !sharing_pays(w)) return;
  w.reuse = automatic ? kSharing : settings.path_reuse;
  w.need.reuse = true;
}

}  // namespace ls::render
