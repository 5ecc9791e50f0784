// The mean of a scene's frame (of a spherical camera: over directions), rendered as a job's is (taken in,
// sent to a worker, rendered in units), with a standard error that low-discrepancy sequences don't fool: the
// two halves of every pixel and all pixels are independent, so that (A - B)^2 / 4 estimates each pixel's
// squared error without bias.
#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "worker/render/render.h"

namespace ls::cli {

// Of every cause.
std::uint64_t samples_gone_wrong(const render::Health& health);
// What went wrong, and where first: "1 majorant_violation, first at pixel (3, 5), sample 17".
std::string told(const render::Health& health);
void add(render::Health& sum, const render::Health& h);

// Every pixel of `size` of a world, one row a task; the sums' planes are those of the whole frame.
render::TileResult render_frame(const render::World& world, FrameSize size, SampleRange samples, int threads);

// The scene as a worker would get it: without what the image does not need, written and read again.
Result<Scene> as_sent(const Scene& scene);

// What a scene asks for, and this seed.
RenderSettings settings_of(const Scene& scene, std::uint64_t seed);

struct Measured {
  enum Quantity { red, green, blue, luminance };  // Nori's weights: .212671, .715160, .072169
  std::array<double, 4> mean{}, standard_error{};
  std::array<double, 4> freedom{};  // of the standard error (Satterthwaite)
  render::Health health;
  std::uint64_t paths = 0;
  double seconds = 0;
  std::uint64_t unhealthy() const { return samples_gone_wrong(health); }
};

// At least `paths` samples, spread evenly over the frame whatever its filter. A frame of few pixels is given
// more, as many independent ones as a standard error needs: its mean stays what it is.
Result<Measured> measure(const Scene& scene, const render::AssetFiles& files, std::uint64_t paths,
                         std::uint64_t seed, int threads);

// The mean of that many (2 or more) such frames, each with seeds of its own and its share of the paths; the
// error is that of a mean of independent figures, with one degree of freedom less than there are.
Result<Measured> measure_frames(const Scene& scene, const render::AssetFiles& files, std::uint64_t paths,
                                std::uint64_t seed, int threads, std::uint64_t frames);

}  // namespace ls::cli
