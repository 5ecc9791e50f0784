#include "worker/render/world/shadow_roulette.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "worker/render/math/processor.h"
#include "worker/render/math/random.h"
#include "worker/render/render.h"

namespace ls::render {
namespace {

constexpr std::uint64_t kPilotSeed = 0x5eed0f5ad0;
// Number of camera paths from which the mean radiance is learned: at most kPilotPaths, and one for each
// kPixelsPerPath pixels of the full frame. A frame that would get fewer than kFewestPaths learns nothing.
constexpr std::uint64_t kPilotPaths = 1 << 10;
constexpr std::uint64_t kPixelsPerPath = 16;
constexpr std::uint64_t kFewestPaths = 16;
constexpr int kPilotDepth = 64;  // paths in a white and dense medium have thousands of segments
// Shadow rays that could bring less than this share of the mean radiance are traced at random.
constexpr float kFaint = 1;

}  // namespace

void learn_shadow_roulette(const IntegratorSettings& settings, World& w) {
  if (settings.shadow_roulette < 0 || !w.need.grids || w.need.connected || !w.lights.can_sample()) return;
  if (!w.depth_allows(1)) return;
  const auto pixels = static_cast<std::uint64_t>(w.frame.width) * static_cast<std::uint64_t>(w.frame.height);
  const std::uint64_t paths = std::min(kPilotPaths, pixels / kPixelsPerPath);
  if (paths < kFewestPaths) return;
  const FlushDenormals mode;
  const std::uint64_t seed = w.seed;
  const int max_depth = w.max_depth;
  w.seed = kPilotSeed;
  if (w.depth_allows(kPilotDepth)) w.max_depth = kPilotDepth;
  RandomStream places(kPilotSeed);
  const auto among = [&](int n) { return static_cast<int>(places.next() % static_cast<std::uint64_t>(n)); };
  double sum = 0;
  for (std::uint64_t i = 0; i < paths; ++i) {
    const int x = among(w.frame.width) - w.origin_x, y = among(w.frame.height) - w.origin_y;
    const SampleValue v = render_sample(w, x, y, i);
    if (v.finite) sum += (double{v.rgb[0]} + double{v.rgb[1]} + double{v.rgb[2]}) / 3;
  }
  w.seed = seed;
  w.max_depth = max_depth;
  const double mean = sum / static_cast<double>(paths);
  if (mean > 0 && std::isfinite(mean)) w.faint_shadow = kFaint * static_cast<float>(mean);
}

}  // namespace ls::render
