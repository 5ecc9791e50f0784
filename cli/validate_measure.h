// The mean of a scene's frame, rendered through the renderer's public face, with a standard error that
// low-discrepancy sequences don't fool: the two halves of every pixel and all pixels are independent, so that
// (A - B)^2 / 4 estimates each pixel's squared error without bias.
#pragma once

#include <array>
#include <cstdint>

#include "worker/render/render.h"

namespace ls::cli {

struct Measured {
  enum Quantity { red, green, blue, luminance };  // Nori's weights: .212671, .715160, .072169
  std::array<double, 4> mean{}, standard_error{};
  std::array<double, 4> freedom{};  // of the standard error (Satterthwaite)
  std::uint64_t nonfinite = 0, paths = 0;
  double seconds = 0;
};

// At least `paths` samples, spread evenly over the frame whatever its filter. A frame of few pixels is given
// more, as many independent ones as a standard error needs: its mean stays what it is.
Result<Measured> measure(const Scene& scene, const render::AssetFiles& files, std::uint64_t paths,
                         std::uint64_t seed, int threads);

}  // namespace ls::cli
