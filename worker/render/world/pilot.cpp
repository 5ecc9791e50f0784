#include "worker/render/world/pilot.h"

#include <algorithm>
#include <cstdint>
#include <utility>

#include "worker/render/math/processor.h"
#include "worker/render/math/random.h"
#include "worker/render/render.h"

namespace ls::render {
namespace {

constexpr std::uint64_t kPilotSeed = 0x5eed0f5ad0;
// Number of camera paths: at most kPilotPaths, and one for each kPixelsPerPath pixels of the full frame. A
// frame that would get fewer than kFewestPaths gets none.
constexpr std::uint64_t kPilotPaths = 1 << 10;
constexpr std::uint64_t kPixelsPerPath = 16;
constexpr std::uint64_t kFewestPaths = 16;

}  // namespace

std::optional<double> pilot_radiance(World& w, int max_depth) {
  const auto pixels = static_cast<std::uint64_t>(w.frame.width) * static_cast<std::uint64_t>(w.frame.height);
  const std::uint64_t paths = std::min(kPilotPaths, pixels / kPixelsPerPath);
  if (paths < kFewestPaths) return std::nullopt;
  const FlushDenormals mode;
  const std::uint64_t seed = std::exchange(w.seed, kPilotSeed);
  const int own_depth = std::exchange(w.max_depth, w.depth_allows(max_depth) ? max_depth : w.max_depth);
  RandomStream places(kPilotSeed);
  const auto among = [&](int n) { return static_cast<int>(places.next() % static_cast<std::uint64_t>(n)); };
  double sum = 0;
  for (std::uint64_t i = 0; i < paths; ++i) {
    const int x = among(w.frame.width) - w.origin_x, y = among(w.frame.height) - w.origin_y;
    const SampleValue v = render_sample(w, x, y, i);
    if (v.finite) sum += (double{v.rgb[0]} + double{v.rgb[1]} + double{v.rgb[2]}) / 3;
  }
  w.seed = seed;
  w.max_depth = own_depth;
  return sum / static_cast<double>(paths);
}

}  // namespace ls::render
