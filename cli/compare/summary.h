// What a race says: of each entrant its error at the end, its efficiency and its curve, over the seeds.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "cli/compare/race.h"
#include "cli/compare/statistics.h"

namespace ls::race {

struct Row {
  std::size_t entrant = 0;
  std::size_t seeds = 0;
  double spp = 0, seconds = 0;         // geometric means at the end
  std::optional<Estimate> relmse;      // at the end
  std::optional<Estimate> efficiency;  // 1 / (relMSE x seconds) at the end
  std::optional<Estimate> slope;       // s of relMSE ~ seconds^-s, from points of doubling samples
  // Efficiency of the first entrant over this one's, seed by seed. Nothing for the first.
  std::optional<Estimate> ratio;
  double spread = 1;  // largest over smallest relMSE at the end: large where few pixels decide
};
// One for each entrant that came to the end, in their order.
std::vector<Row> rows_of(const Race& race);

struct CurveAt {
  double spp = 0, seconds = 0;
  Estimate relmse;
};
// Where the lanes of an entrant were at the same samples, and where they ended: geometric means over the
// seeds. What less than half of the seeds reached, and errors below the reference's noise, are left out.
std::vector<CurveAt> curve_of(const Race& race, std::size_t entrant);

}  // namespace ls::race
