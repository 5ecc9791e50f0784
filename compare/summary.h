// The results of a race: for each entrant its final error, its efficiency and its curve of error over time,
// as means over the seeds.
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
  std::optional<Estimate> slope;       // s of relMSE ~ seconds^-s, fitted to points at doubling sample counts
  // The first entrant's efficiency divided by this one's, as geometric mean over the seeds. nullopt for the
  // first entrant.
  std::optional<Estimate> ratio;
  double spread = 1;  // largest final relMSE of a seed over the smallest: large if few pixels dominate
};
// Returns one row per entrant that finished, in the order of the entrants.
std::vector<Row> rows_of(const Race& race);

struct CurveAt {
  double spp = 0, seconds = 0;
  Estimate relmse;
};
// Returns the curve of an entrant: geometric means over the seeds at each sample count that the runs of the
// different seeds share, and at the ends of the runs. Sample counts that fewer than half of the seeds
// reached, and errors below the reference's noise, are omitted.
std::vector<CurveAt> curve_of(const Race& race, std::size_t entrant);

}  // namespace ls::race
