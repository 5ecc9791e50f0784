// Compares two remaining times of our renders: the one predicted while a render ran, and the actual one.
#pragma once

#include <string>
#include <vector>

#include "compare/race.h"

namespace ls::race {

struct Prediction {
  std::size_t entrant = 0, seed = 0;
  // `spp` and `spent` are the samples per pixel and the core seconds used when the prediction was made.
  double spp = 0, spent = 0;
  double target = 0;                     // the relMSE to be reached, as the image estimates it
  double predicted = 0, lo = 0, hi = 0;  // remaining core seconds, with the 95 % interval
  std::optional<double> actual;          // nullopt: the race ended before that, hence later than `hi`
  bool within() const { return actual && *actual >= lo && *actual <= hi; }
};
// Returns the forecasts of all renders, made at 8 samples per pixel and at each doubling after that. Each
// uses forecast_of() on the checkpoints (measured images of a render) so far. Its targets are 1/2, 1/4 and
// 1/8 of the relMSE estimated at that time. A forecast is included only if its interval ends before the
// render does. This condition depends on no error measured later, so it does not favour correct forecasts.
std::vector<Prediction> predictions_of(const Race& race);

}  // namespace ls::race
