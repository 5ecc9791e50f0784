#include "worker/render/world/pilot.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>

#include "core/image/error/relative_weights.h"
#include "worker/render/base/in_order.h"
#include "worker/render/geometry/moment.h"
#include "worker/render/math/processor.h"
#include "worker/render/math/random.h"
#include "worker/render/media/optical_depth.h"
#include "worker/render/render.h"
#include "worker/render/world/near_plane.h"

namespace ls::render {
namespace {

constexpr std::uint64_t kPilotSeed = 0x5eed0f5ad0;
// The number of camera paths of pilot_radiance(): one for every kPixelsPerPath pixels of the full frame, but
// at most kPilotPaths. A frame that would get fewer than kFewestPaths gets none.
constexpr std::uint64_t kPilotPaths = 1 << 10;
constexpr std::uint64_t kPixelsPerPath = 16;
constexpr std::uint64_t kFewestPaths = 16;
// The number of pixels that pilot_pixels() renders, and the number of samples of each of them.
constexpr std::uint64_t kNoisePixels = 128;
constexpr std::uint64_t kNoiseSamples = 16;
// pilot_pays() is false for frames of fewer pixels than kPilotFrame, and for scenes in which light passes
// through more than kPilotBoundaries shapes.
constexpr std::uint64_t kPilotFrame = 256;
constexpr std::ptrdiff_t kPilotBoundaries = 64;

std::uint64_t pixels_of(const World& w) {
  return static_cast<std::uint64_t>(w.frame.width) * static_cast<std::uint64_t>(w.frame.height);
}

// Returns a random pixel of the full frame. Its coordinates are relative to the image, which may be a crop,
// so they may lie outside of the image.
std::pair<int, int> somewhere(const World& w, RandomStream& places) {
  const auto among = [&](int n) { return static_cast<int>(places.next() % static_cast<std::uint64_t>(n)); };
  const int x = among(w.frame.width) - w.origin_x;
  return {x, among(w.frame.height) - w.origin_y};
}

// Returns the probability that media scatter or absorb a camera ray before it hits a surface.
float met_by(const World& w, const CameraRay& ray) {
  const Moment moment(w.geometry, ray.time);
  V3 start = ray.o, origin = ray.o;
  std::uint32_t medium = w.camera_medium;
  const auto beyond = [&](const SurfaceHit& hit, const SurfaceInfo& surface) {
    if (surface.transition) medium = dot(ray.d, hit.ng) > 0 ? surface.exterior : surface.interior;
  };
  if (w.hidden_boundaries) for_hidden_boundaries(w, ray, beyond);
  float passes = 1, left = ray.t_max;
  constexpr int kMaxBoundaries = 16;
  for (int i = 0; i < kMaxBoundaries; ++i) {
    SurfaceHit hit;
    const auto primitive = w.accel.nearest(origin, ray.d, left, moment);
    const bool met = primitive && w.geometry.complete(*primitive, origin, ray.d, moment, hit);
    if (medium != kNone) {
      const Medium& m = w.media[medium];
      const OpticalDepth depths(m, start, ray.d, met ? dot(hit.p - start, ray.d) : left);
      // If both the ray and the medium are infinite, the optical depth is infinite, or NaN (0 times infinity)
      // if sigma_t is 0; NaN then counts as a depth of 0.
      const float depth = mean_component(m.sigma_t) * depths.total();
      passes *= depth > 0 ? std::exp(-depth) : 1.f;
    }
    const SurfaceInfo* surface = met ? &w.geometry.surfaces[hit.surface] : nullptr;
    if (!met || !surface->null) break;
    beyond(hit, *surface);
    start = hit.p;
    origin = offset_point(hit, ray.d);
    left = kInfinity;
  }
  return 1 - passes;
}

}  // namespace

PilotSettings::PilotSettings(World& w, std::uint64_t seed, int max_depth)
    : w_(w), seed_(w.seed), max_depth_(w.max_depth) {
  w.seed = seed;
  if (w.depth_allows(max_depth)) w.max_depth = max_depth;
}
PilotSettings::~PilotSettings() {
  w_.seed = seed_;
  w_.max_depth = max_depth_;
}

bool pilot_pays(const World& w) {
  const auto is_boundary = [](const SurfaceInfo& s) { return s.null || s.null_transmission; };
  return pixels_of(w) >= kPilotFrame &&
         std::ranges::count_if(w.geometry.surfaces, is_boundary) <= kPilotBoundaries;
}

std::optional<double> pilot_radiance(World& w, int max_depth) {
  const std::uint64_t paths = std::min(kPilotPaths, pixels_of(w) / kPixelsPerPath);
  if (paths < kFewestPaths) return std::nullopt;
  const FlushDenormals mode;
  const PilotSettings settings(w, kPilotSeed, max_depth);
  RandomStream places(kPilotSeed);
  double sum = 0;
  for (std::uint64_t i = 0; i < paths; ++i) {
    const auto [x, y] = somewhere(w, places);
    const SampleValue v = render_sample(w, x, y, i);
    if (v.finite) sum += (double{v.rgb[0]} + double{v.rgb[1]} + double{v.rgb[2]}) / 3;
  }
  return sum / static_cast<double>(paths);
}

std::vector<PilotPixel> pilot_pixels(World& w, int max_depth, int threads) {
  const PilotSettings settings(w, kPilotSeed, max_depth);
  const auto pixel = [&w](std::size_t i) -> std::optional<PilotPixel> {
    const FlushDenormals mode;
    RandomStream places(combine(kPilotSeed, i));
    const auto [x, y] = somewhere(w, places);
    V3d sum(0), squares(0);
    for (std::uint64_t n = 0; n < kNoiseSamples; ++n) {
      const SampleValue v = render_sample(w, x, y, n);
      if (!v.finite) return std::nullopt;
      const V3d value(v.rgb[0], v.rgb[1], v.rgb[2]);
      sum += value;
      squares += value * value;
    }
    constexpr double k = kNoiseSamples;
    const V3d mean = sum / k;
    return PilotPixel{mean, (squares / k - mean * mean) * (k / (k - 1))};
  };
  std::vector<PilotPixel> all;
  in_order(threads, kNoisePixels, pixel, [&](const std::optional<PilotPixel>& one) {
    if (one)
      all.push_back(*one);
    else
      all.clear();
    return one.has_value();
  });
  return all;
}

bool is_noisier(const std::vector<PilotPixel>& a, const std::vector<PilotPixel>& b, double factor) {
  if (a.empty() || b.empty()) return false;
  double sum_a = 0, sum_b = 0;
  for (std::size_t i = 0; i < a.size(); ++i)
    for (int c = 0; c < 3; ++c) {
      const double mean = (a[i].mean[c] + b[i].mean[c]) / 2, weight = 1 / (mean * mean + kRelMseDenominator);
      sum_a += a[i].variance[c] * weight;
      sum_b += b[i].variance[c] * weight;
    }
  return sum_a > factor * sum_b;
}

CameraCollisions camera_collisions(const World& w) {
  constexpr int kLattice = 16;
  constexpr float kNothing = 1e-3f;
  double all = 0, met = 0;
  int rays = 0;
  for (int j = 0; j < kLattice; ++j)
    for (int i = 0; i < kLattice; ++i) {
      const double x = (i + .5) / kLattice * w.frame.width, y = (j + .5) / kLattice * w.frame.height;
      // Rows and columns take turns at the times of the exposure.
      const float time = (static_cast<float>((7 * j + 5 * i) % kLattice) + .5f) / kLattice;
      const float p =
          met_by(w, w.moves ? w.camera.ray_at(time, x, y, {.5f, .5f}) : w.camera.ray(x, y, {.5f, .5f}));
      all += p;
      if (!(p > kNothing)) continue;
      met += p;
      ++rays;
    }
  return {static_cast<float>(all / (kLattice * kLattice)), rays > 0 ? static_cast<float>(met / rays) : 0};
}

}  // namespace ls::render
