// Predicted against actual: what our renders said, on their way, of the time that they would still need.
#pragma once

#include <string>
#include <vector>

#include "cli/compare/race.h"

namespace ls::race {

struct Prediction {
  std::size_t entrant = 0, seed = 0;
  double spp = 0, spent = 0;             // where it was made: samples and core seconds
  double target = 0;                     // relMSE, as estimated
  double predicted = 0, lo = 0, hi = 0;  // core seconds still to spend, with the 95 % interval
  std::optional<double> actual;          // nothing: not reached by the end of the race, and so later than hi
  bool within() const { return actual && *actual >= lo && *actual <= hi; }
};
// At each doubling of the samples from 8 on, for a half, a quarter and an eighth of the error estimated then,
// by forecast_of() from the checkpoints up to there. Only those whose interval ends within the race: whether
// one counts is then decided before its outcome.
std::vector<Prediction> predictions_of(const Race& race);

}  // namespace ls::race
