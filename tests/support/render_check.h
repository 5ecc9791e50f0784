// Renders a scene to the mean of its pixels. The standard error is valid for low-discrepancy sequences, too:
// the two halves of every pixel's samples are independent, and so are all pixels, since the builder leaves
// path_reuse off and no paths are shared between them. So (A - B)^2 / 4, with A and B the means of the
// halves, estimates each pixel's squared error without bias.
#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <stdexcept>
#include <thread>
#include <vector>

#include "core/scene/schema/validate.h"
#include "tests/support/scene_builder.h"
#include "worker/render/render.h"

namespace ls::test {

inline RenderSettings settings_of(const Scene& s, std::uint64_t seed = 0) {
  RenderSettings r;
  r.size = s.film.image_size();
  r.meters = static_cast<int>(scene::meter_count(s));
  r.seed = seed;
  r.integrator = s.integrator.name;
  r.max_depth = s.integrator.max_depth;
  r.rr_depth = s.integrator.rr_depth;
  return r;
}

struct Estimate {
  std::array<double, 3> mean{}, standard_error{};
  // Degrees of freedom of the standard error (Satterthwaite, from the fourth powers of the differences): few
  // if a few pixels dominate.
  std::array<double, 3> freedom{};
  Health health;
  std::string variant;
  double seconds = 0;
};

// Throws std::runtime_error with the renderer's message if the world cannot be built: this is a mistake in
// the test.
inline std::shared_ptr<const render::World> world_of(const SceneBuilder& builder, std::uint64_t seed = 0,
                                                     int threads = 1) {
  auto w = render::build_world(builder.scene, settings_of(builder.scene, seed), builder.files, threads);
  if (!w) throw std::runtime_error(w.error().message);
  return *w;
}

// Both halves of an image: for each half the means of the planes R, G, B, pixel by pixel.
struct HalfImages {
  std::array<std::array<std::vector<double>, 3>, 2> mean;
  Health health;
  std::string variant;
};

inline HalfImages half_images(const SceneBuilder& builder, std::uint64_t spp, std::uint64_t seed = 0,
                              int threads = 2) {
  const auto world = world_of(builder, seed, threads);
  const FrameSize size = builder.scene.film.image_size();
  const int rows = render::tile_alignment(*world);
  std::vector<render::TileResult> results(static_cast<std::size_t>((size.height + rows - 1) / rows));
  std::atomic<std::size_t> next{0};
  const auto work = [&] {
    for (std::size_t i; (i = next++) < results.size();) {
      const int top = static_cast<int>(i) * rows;
      results[i] = render::render_tile(*world, {0, top, size.width, std::min(top + rows, size.height)},
                                       {0, spp}, nullptr, nullptr);
    }
  };
  {
    std::vector<std::jthread> pool;
    for (int i = 0; i < threads; ++i) pool.emplace_back(work);
  }
  HalfImages out;
  out.variant = render::describe(*world).variant;
  for (const auto& r : results) {
    const std::size_t count = r.sums.size() / 6;
    for (std::size_t i = 0; i < r.sums.size(); ++i)
      out.mean[i / count / 3][i / count % 3].push_back(double{r.sums[i]} * 2 / static_cast<double>(spp));
    out.health.merge(r.health);
  }
  return out;
}

inline Estimate estimate(const HalfImages& image) {
  Estimate e;
  e.variant = image.variant;
  e.health = image.health;
  for (std::size_t c = 0; c < 3; ++c) {
    const auto &as = image.mean[0][c], &bs = image.mean[1][c];
    const auto pixels = static_cast<double>(as.size());
    double sum = 0, square = 0, fourth = 0;
    for (std::size_t i = 0; i < as.size(); ++i) {
      const double v = (as[i] - bs[i]) * (as[i] - bs[i]) / 4;
      sum += (as[i] + bs[i]) / 2;
      square += v;
      fourth += v * v;
    }
    e.mean[c] = sum / pixels;
    e.standard_error[c] = std::sqrt(square) / pixels;
    e.freedom[c] = fourth > 0 ? 3 * square * square / fourth : pixels;
  }
  return e;
}

inline Estimate estimate(const SceneBuilder& builder, std::uint64_t spp, std::uint64_t seed = 0,
                         int threads = 2) {
  return estimate(half_images(builder, spp, seed, threads));
}

// The difference of two images of the same scene by other means, a - b. What both sample alike cancels in it
// and in its standard error.
inline Estimate difference(HalfImages a, const HalfImages& b) {
  for (std::size_t half = 0; half < 2; ++half)
    for (std::size_t c = 0; c < 3; ++c)
      for (std::size_t i = 0; i < b.mean[half][c].size(); ++i) a.mean[half][c][i] -= b.mean[half][c][i];
  return estimate(a);
}

}  // namespace ls::test
