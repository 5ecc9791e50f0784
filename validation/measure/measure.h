// Measures the mean of a scene's frame (for a spherical camera: over directions). The scene is treated like a
// job's: submitted, sent to a worker, rendered in ranges of samples. The standard error is valid for
// low-discrepancy sequences: the two halves of every pixel's samples are independent, and so are all pixels,
// so (A - B)^2 / 4, with A and B the means of the halves, estimates each pixel's squared error without bias.
#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "worker/render/render.h"

namespace ls::cli {

// Returns the number of faulty samples, of all causes together.
std::uint64_t samples_gone_wrong(const render::Health& health);
// Returns the causes with their counts and the first location, such as "1 majorant_violation, first at pixel
// (3, 5), sample 17".
std::string health_text(const render::Health& health);

// Renders every pixel of `size`, in bands of render::tile_alignment() rows, on `threads` threads; the planes
// of the sums cover the whole frame.
render::TileResult render_frame(const render::World& world, FrameSize size, SampleRange samples, int threads);

// Returns the scene as a worker receives it: pruned (without what affects no pixel), written and read again.
Result<Scene> as_sent(const Scene& scene);

// Returns the scene's settings, with this seed.
RenderSettings settings_of(const Scene& scene, std::uint64_t seed);

struct Measured {
  // luminance uses Nori's weights: 0.212671, 0.715160, 0.072169
  enum Quantity { red, green, blue, luminance };
  std::array<double, 4> mean{}, standard_error{};
  std::array<double, 4> freedom{};  // degrees of freedom of the standard error (Satterthwaite)
  render::Health health;
  std::uint64_t paths = 0;
  double seconds = 0;
  std::uint64_t unhealthy() const { return samples_gone_wrong(health); }
};

// Renders at least `paths` samples, spread evenly over the frame whatever its filter, and measures their
// mean. If the frame has too few pixels to estimate a standard error, it is rendered with more pixels; this
// does not change the mean.
Result<Measured> measure(const Scene& scene, const render::AssetFiles& files, std::uint64_t paths,
                         std::uint64_t seed, int threads);

// Measures the mean of `frames` (at least 2) such frames, each with its own seeds and its share of `paths`.
// The standard error is estimated from the differences of their means, with frames - 1 degrees of freedom.
Result<Measured> measure_frames(const Scene& scene, const render::AssetFiles& files, std::uint64_t paths,
                                std::uint64_t seed, int threads, std::uint64_t frames);

}  // namespace ls::cli
