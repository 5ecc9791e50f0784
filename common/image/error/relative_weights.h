// The weights of relMSE in one tile, as derived in error_estimate.h. Branch-free loops over rows, which the
// compiler vectorises: the estimate is made for every folded unit and must cost much less than rendering it.
#pragma once

#include <vector>

#include "common/image/error/error_estimate.h"

namespace ls {

// relMSE divides a squared error by the squared truth plus this.
inline constexpr double kRelMseDenominator = 0.01;

// For each pixel: the square root of the weight in each channel and its derivative by the pixel's own value
// (`leans`), planar, and the square of the mean of g over channels (`edges`).
struct RelativeWeights {
  std::vector<double> roots, leans, edges;
};
RelativeWeights relative_weights(const HalfMeans& halves);

// Sums over one tile. `values`: three planes of width x height; `edges`: one.
NoiseSums noise_sums(const std::vector<double>& values, const std::vector<double>& edges, int width,
                     int height);

}  // namespace ls
