#include "validation/measure/measure.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <numbers>
#include <thread>
#include <vector>

#include "core/base/clock.h"
#include "core/scene/analysis/prune.h"
#include "core/scene/json/serialize.h"
#include "core/scene/schema/validate.h"
#include "worker/render/render.h"

namespace ls::cli {
namespace {

constexpr double kEnoughPixels = 1024;
constexpr std::size_t kPlanes = 6;  // render_tile() sums R, G and B of each half of the samples
constexpr double kLuminance[3] = {.212671, .715160, .072169};

FrameSize enough(FrameSize size) {
  const double pixels = static_cast<double>(size.width) * size.height;
  const int factor = std::max(1, static_cast<int>(std::ceil(std::sqrt(kEnoughPixels / pixels))));
  return {size.width * factor, size.height * factor};
}

// Sums over the pixels of a frame: `mean` sums the means of the pixels, `square` their estimated squared
// errors, `fourth` the squares of these squared errors.
struct Sums {
  double mean = 0, square = 0, fourth = 0;
  void add(double weight, double a, double b) {
    const double v = weight * weight * (a - b) * (a - b) / 4;
    mean += weight * (a + b) / 2;
    square += v;
    fourth += v * v;
  }
};

// Returns, for each row of pixels, the weight of its pixels in the mean of the frame; the mean weight is 1.
// For a spherical camera a weight is proportional to the solid angle of the pixel, so that the mean is over
// directions. For other cameras all weights are equal.
std::vector<double> row_weights(const Scene& scene, FrameSize size) {
  std::vector<double> weights(static_cast<std::size_t>(size.height), 1);
  if (scene.sensor.projection != Projection::spherical) return weights;
  const double step = std::numbers::pi / size.height;
  for (std::size_t y = 0; y < weights.size(); ++y) {
    const auto row = static_cast<double>(y);
    weights[y] = (std::cos(row * step) - std::cos((row + 1) * step)) / 2 * size.height;
  }
  return weights;
}

void collect(const render::TileResult& frame, const std::vector<double>& weights, std::size_t count,
             double per_half, Measured& m) {
  const std::size_t width = count / weights.size();
  std::array<Sums, 4> sums;
  m.health = frame.health;
  for (std::size_t i = 0; i < count; ++i) {
    const double weight = weights[i / width];
    double bright[2] = {0, 0};
    for (std::size_t c = 0; c < 3; ++c) {
      const double a = frame.sums[c * count + i] / per_half, b = frame.sums[(3 + c) * count + i] / per_half;
      sums[c].add(weight, a, b);
      bright[0] += kLuminance[c] * a;
      bright[1] += kLuminance[c] * b;
    }
    sums[Measured::luminance].add(weight, bright[0], bright[1]);
  }
  const auto pixels = static_cast<double>(count);
  for (std::size_t k = 0; k < 4; ++k) {
    m.mean[k] = sums[k].mean / pixels;
    m.standard_error[k] = std::sqrt(sums[k].square) / pixels;
    m.freedom[k] = sums[k].fourth > 0 ? 3 * sums[k].square * sums[k].square / sums[k].fourth : pixels;
  }
}

}  // namespace

std::uint64_t samples_gone_wrong(const render::Health& health) {
  return health.nonfinite + health.negative + health.majorant_violations;
}

std::string health_text(const render::Health& health) {
  std::string text;
  for (const auto& [cause, entry] : health.causes) {
    if (effect_of(cause) == HealthEffect::input) continue;
    text += fmt::format("{}{} {}", text.empty() ? "" : "; ", entry.count, to_string(cause));
    if (!entry.first.empty())
      text += fmt::format(", first at pixel ({}, {}), sample {}", entry.first[0].x, entry.first[0].y,
                          entry.first[0].sample);
  }
  return text;
}

render::TileResult render_frame(const render::World& world, FrameSize size, SampleRange samples,
                                int threads) {
  const auto width = static_cast<std::size_t>(size.width),
             count = width * static_cast<std::size_t>(size.height);
  const int rows = render::tile_alignment(world);
  std::vector<render::TileResult> bands(static_cast<std::size_t>((size.height + rows - 1) / rows));
  std::atomic<std::size_t> next{0};
  const auto work = [&] {
    for (std::size_t b; (b = next++) < bands.size();) {
      const int top = static_cast<int>(b) * rows;
      bands[b] = render::render_tile(world, {0, top, size.width, std::min(top + rows, size.height)}, samples,
                                     nullptr, nullptr);
    }
  };
  {
    std::vector<std::jthread> pool;
    for (int i = 0; i < threads; ++i) pool.emplace_back(work);
  }
  render::TileResult frame;
  frame.sums.resize(kPlanes * count);
  std::size_t done = 0;
  for (const render::TileResult& band : bands) {
    frame.health.merge(band.health);
    const std::size_t pixels = band.sums.size() / kPlanes;
    for (std::size_t plane = 0; plane < kPlanes; ++plane)
      std::copy_n(band.sums.begin() + static_cast<std::ptrdiff_t>(plane * pixels), pixels,
                  frame.sums.begin() + static_cast<std::ptrdiff_t>(plane * count + done));
    done += pixels;
  }
  return frame;
}

Result<Scene> as_sent(const Scene& scene) {
  const auto whom = scene::pruned_for(scene.integrator.name, scene.integrator.max_depth);
  return deserialize_scene(serialize(scene::pruned(scene, whom).scene));
}

RenderSettings settings_of(const Scene& scene, std::uint64_t seed) {
  RenderSettings settings;
  settings.size = scene.film.image_size();
  settings.meters = static_cast<int>(scene::meter_count(scene));
  settings.seed = seed;
  settings.integrator = scene.integrator.name;
  settings.max_depth = scene.integrator.max_depth;
  settings.rr_depth = scene.integrator.rr_depth;
  return settings;
}

Result<Measured> measure(const Scene& given, const render::AssetFiles& files, std::uint64_t paths,
                         std::uint64_t seed, int threads) {
  const SystemClock clock;
  const TimePoint start = clock.now();
  Scene asked = given;
  asked.film.size = enough(given.film.size);
  asked.film.filter = BoxFilter{};
  const auto sent = as_sent(asked);
  if (!sent) return tl::unexpected(sent.error());
  const Scene& scene = *sent;
  const FrameSize size = scene.film.size;
  const RenderSettings settings = settings_of(scene, seed);
  const auto limit = render::limit_threads(threads);
  const auto world = render::build_world(scene, settings, files, threads);
  if (!world) return tl::unexpected(world.error());
  const auto pixels = static_cast<std::uint64_t>(size.width) * static_cast<std::uint64_t>(size.height);
  const std::uint64_t per_half = std::max<std::uint64_t>(1, (paths + 2 * pixels - 1) / (2 * pixels));
  Measured m;
  m.paths = 2 * per_half * pixels;
  collect(render_frame(**world, size, {0, 2 * per_half}, threads), row_weights(scene, size), pixels,
          static_cast<double>(per_half), m);
  m.seconds = seconds(clock.now() - start);
  return m;
}

Result<Measured> measure_frames(const Scene& scene, const render::AssetFiles& files, std::uint64_t paths,
                                std::uint64_t seed, int threads, std::uint64_t frames) {
  Measured all;
  std::array<double, 4> squares{};  // sums of squared deviations from the mean (Welford)
  for (std::uint64_t i = 0; i < frames; ++i) {
    const auto frame = measure(scene, files, paths / frames, seed + i * 0x9e3779b97f4a7c15ull, threads);
    if (!frame) return tl::unexpected(frame.error());
    for (std::size_t k = 0; k < 4; ++k) {
      const double before = frame->mean[k] - all.mean[k];
      all.mean[k] += before / static_cast<double>(i + 1);
      squares[k] += before * (frame->mean[k] - all.mean[k]);
    }
    all.health.merge(frame->health);
    all.paths += frame->paths;
    all.seconds += frame->seconds;
  }
  const auto n = static_cast<double>(frames);
  for (std::size_t k = 0; k < 4; ++k) {
    all.standard_error[k] = std::sqrt(squares[k] / (n * (n - 1)));
    all.freedom[k] = n - 1;
  }
  return all;
}

}  // namespace ls::cli
