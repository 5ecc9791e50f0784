// Predicted against actual: what our renders predicted, while running, about their remaining time.
#pragma once

#include <string>
#include <vector>

#include "compare/race.h"

namespace ls::race {

struct Prediction {
  std::size_t entrant = 0, seed = 0;
  double spp = 0, spent = 0;             // samples and core seconds when it was made
  double target = 0;                     // relMSE, as estimated by the image
  double predicted = 0, lo = 0, hi = 0;  // remaining core seconds, with the 95 % interval
  std::optional<double> actual;          // nullopt: not reached by the end of the race, hence later than hi
  bool within() const { return actual && *actual >= lo && *actual <= hi; }
};
// Predictions at each doubling of the samples from 8 on, for a half, a quarter and an eighth of the error
// estimated then, by forecast_of() from the checkpoints so far. Only those whose interval ends within the
// race, so that the choice does not depend on the outcome.
std::vector<Prediction> predictions_of(const Race& race);

}  // namespace ls::race
