// Checks forecasts of render times. While Lightshaft renders, it can predict the remaining time until the
// estimated error (relMSE, the mean squared relative error) reaches a target. The forecasts are made again
// here from the measurements of a race (race.h: integrators render a scene at equal cost) and compared with
// the actual times.
#pragma once

#include <string>
#include <vector>

#include "compare/race.h"

namespace ls::race {

struct Prediction {
  std::size_t entrant = 0, seed = 0;
  // Samples per pixel, and core seconds used, when the prediction was made.
  double spp = 0, spent = 0;
  double target = 0;                     // relMSE to be reached, as the render itself estimates it
  double predicted = 0, lo = 0, hi = 0;  // remaining core seconds; lo and hi bound the 95 % interval
  // The remaining core seconds that were needed; nullopt: the render ended, later than `hi`, without reaching
  // the target.
  std::optional<double> actual;
  bool within() const { return actual && *actual >= lo && *actual <= hi; }
};
// Returns the forecasts of all renders of a race, made at 8 samples per pixel and at each doubling after
// that. Each uses forecast_of() on the checkpoints (measured images of the render) up to that time. The
// targets are 1/2, 1/4 and 1/8 of the relMSE estimated at that time. A forecast is included only if its
// interval ends before the render does. This condition does not depend on later measurements of the error, so
// it does not favour correct forecasts.
std::vector<Prediction> predictions_of(const Race& race);

}  // namespace ls::race
