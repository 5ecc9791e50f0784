// Measures the mean of the frame of a scene (for a spherical camera: the mean over directions). The scene is
// treated like that of a job: pruned, serialized, read again, and rendered in ranges of samples. The standard
// error is valid for low-discrepancy sequences. The two halves of the samples of a pixel are independent, and
// so are all pixels. So (A - B)^2 / 4, with A and B the means of the halves, estimates the squared error of
// each pixel without bias.
#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "worker/render/render.h"

namespace ls::cli {

// Returns the number of faulty samples, of all causes together.
std::uint64_t samples_gone_wrong(const render::Health& health);
// Returns the causes of faulty samples with their counts and the first location of each, such as
// "1 majorant_violation, first at pixel (3, 5), sample 17".
std::string health_text(const render::Health& health);

// Renders every pixel of a frame of this size on `threads` threads, in bands of render::tile_alignment()
// rows. The planes of the sums in the result cover the whole frame.
render::TileResult render_frame(const render::World& world, FrameSize size, SampleRange samples, int threads);

// Returns the scene as a worker receives it: pruned (without what affects no pixel), written and read again.
Result<Scene> as_sent(const Scene& scene);

// Returns the render settings that the scene asks for, with this seed.
RenderSettings settings_of(const Scene& scene, std::uint64_t seed);

struct Measured {
  // Luminance is 0.212671 R + 0.715160 G + 0.072169 B, as in Nori.
  enum Quantity { red, green, blue, luminance };
  std::array<double, 4> mean{}, standard_error{};
  std::array<double, 4> freedom{};  // degrees of freedom of the standard error (Satterthwaite)
  render::Health health;
  std::uint64_t paths = 0;
  double seconds = 0;
  std::uint64_t unhealthy() const { return samples_gone_wrong(health); }
};

// Renders the frame with at least `paths` samples, equally many for each pixel and with a box filter whatever
// the filter of the scene, and measures their mean. If the frame has too few pixels to estimate a standard
// error, it is rendered with more pixels; this does not change the mean.
Result<Measured> measure(const Scene& scene, const render::AssetFiles& files, std::uint64_t paths,
                         std::uint64_t seed, int threads);

// Like measure(), but renders `frames` (at least 2) whole frames, each with its own seed and its share of
// `paths`. The standard error is estimated from the differences of the means of the frames, with frames - 1
// degrees of freedom.
Result<Measured> measure_frames(const Scene& scene, const render::AssetFiles& files, std::uint64_t paths,
                                std::uint64_t seed, int threads, std::uint64_t frames);

}  // namespace ls::cli
