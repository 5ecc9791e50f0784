// The weights of relMSE in one tile, as derived in error_estimate.h. The film estimates the error after every
// unit, and this must cost much less than rendering the unit. So the loops over rows have no branches, and
// the compiler vectorises them.
#pragma once

#include <vector>

#include "core/image/error/error_estimate.h"

namespace ls {

// relMSE is a squared error divided by the sum of the squared true value and this constant.
inline constexpr double kRelMseDenominator = 0.01;

// The weights w of the pixels of a tile, for relMSE. `roots` is the square root of the weight in each
// channel, and `leans` the derivative of the weight with respect to the pixel's own value; both have three
// planes. `edges` has one plane: the square of the mean of g (error_estimate.h) over the channels. `unsure`
// has one plane: delta (error_estimate.h), what the pixel would lose if it were as bright as it looks.
struct RelativeWeights {
  std::vector<double> roots, leans, edges, unsure;
};
RelativeWeights relative_weights(const HalfMeans& halves);

// Returns sums over one tile. `values` has three planes of width x height values: D, or sqrt(w) D
// (error_estimate.h). `edges` has one plane, as in RelativeWeights.
NoiseSums noise_sums(const std::vector<double>& values, const std::vector<double>& edges, int width,
                     int height);

}  // namespace ls
