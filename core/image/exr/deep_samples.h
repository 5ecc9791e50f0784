// How the slices of a pixel (core/image/aov/deep_planes.h) become the samples of a deep EXR.
#pragma once

#include <array>
#include <vector>

namespace ls {

// One pixel of a deep image as its sums say it: means over all samples.
struct DeepPixel {
  std::vector<double> edges;          // for each record its edge, with its sign
  std::vector<double> transmittance;  // for each record
  // R, G, B of each record; empty if the slices have no colours
  std::vector<std::array<double, 3>> light;
};

// One sample of a pixel of a deep EXR. Its colour is multiplied by its own alpha, but not by the
// transmittance of the samples in front of it.
struct DeepSample {
  float z = 0, z_back = 0;
  float alpha = 0;
  std::array<float, 3> rgb{0, 0, 0};
  bool operator==(const DeepSample&) const = default;
};
// Returns the samples of a pixel, sorted by depth, none over another. Slices without light and alpha give no
// sample. Laid over each other from the front, the samples give the pixel's light, and 1 minus the last
// transmittance as alpha, up to the rounding of one number of the file. For this, each colour is computed
// from the alphas as they are rounded in the file. A slice that is seen through so little that its colour
// would not fit the file is joined to the one in front of it. `halves`: colours and alpha are stored as half
// floats. Any numbers give samples that a deep EXR may have: with alphas from 0 to 1, and finite.
std::vector<DeepSample> deep_samples(const DeepPixel& pixel, bool halves);

}  // namespace ls
