// The results of a race: for each entrant its final error, its efficiency and its curve, over the seeds.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "compare/race.h"
#include "compare/statistics.h"

namespace ls::race {

struct Row {
  std::size_t entrant = 0;
  std::size_t seeds = 0;
  double spp = 0, seconds = 0;         // geometric means at the end
  std::optional<Estimate> relmse;      // at the end
  std::optional<Estimate> efficiency;  // 1 / (relMSE x seconds) at the end
  std::optional<Estimate> slope;       // s of relMSE ~ seconds^-s, from points of doubling samples
  // Efficiency of the first entrant divided by this one's, seed by seed. nullopt for the first.
  std::optional<Estimate> ratio;
  double spread = 1;  // largest over smallest final relMSE: large if few pixels dominate
};
// One row per entrant that finished, in their order.
std::vector<Row> rows_of(const Race& race);

struct CurveAt {
  double spp = 0, seconds = 0;
  Estimate relmse;
};
// Geometric means over the seeds at each sample count shared by an entrant's lanes, and at their ends. Sample
// counts reached by less than half of the seeds, and errors below the reference's noise, are omitted.
std::vector<CurveAt> curve_of(const Race& race, std::size_t entrant);

}  // namespace ls::race
