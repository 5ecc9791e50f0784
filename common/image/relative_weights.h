// The weights of relMSE in one tile, as error_estimate.h derives them. Loops over rows without branches,
// which the compiler makes vectors of: the estimate is made for every folded unit, and is to cost a small
// part of what rendering it did.
#pragma once

#include <vector>

#include "common/image/error_estimate.h"

namespace ls {

// Of each pixel: the square root of the weight in each channel and how it leans (its derivative by the
// pixel's own value), planar, and the square of the mean of g over channels.
struct RelativeWeights {
  std::vector<double> roots, leans, edges;
};
RelativeWeights relative_weights(const HalfMeans& halves);

// Sums of one tile. `values`: three planes of width x height; `edges`: one.
NoiseSums noise_sums(const std::vector<double>& values, const std::vector<double>& edges, int width,
                     int height);

}  // namespace ls
