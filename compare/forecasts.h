// Predicted against actual times: what our renders predicted, while running, about their remaining time.
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
  std::optional<double> actual;          // nullopt: not reached by the end of the race, hence later than hi
  bool within() const { return actual && *actual >= lo && *actual <= hi; }
};
// Returns predictions that were made at each doubling of the samples, from 8 per pixel on. Each is what
// forecast_of() predicts from the checkpoints (measured images of a render) up to then, for reaching a half,
// a quarter or an eighth of the error estimated at that time. Only predictions whose interval ends within the
// race are returned, so that the choice does not depend on the outcome.
std::vector<Prediction> predictions_of(const Race& race);

}  // namespace ls::race
