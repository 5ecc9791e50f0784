// The results of a race: for each entrant its final error, its efficiency and its curve of error over time,
// as means over the seeds.
//
// Errors, times and efficiencies are positive and vary by factors, so they are averaged as logarithms: the
// mean is geometric, and its 95 % interval is Student's t over the seeds, which are independent renders.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "compare/race.h"

namespace ls::race {

struct Estimate {
  double value = 0, lo = 0, hi = 0;  // 95 % interval; unbounded for a single value
};

// Returns the geometric mean of positive values; the interval of a single value is (0, infinity). nullopt:
// there are no values, or one of them is not a positive finite number.
std::optional<Estimate> geometric_mean(std::span<const double> values);

// Returns the geometric mean of the ratios a[i] / b[i]. Effects common to both at the same i (such as the
// machine's speed at that time) cancel. nullopt: a and b have different sizes, or geometric_mean() of the
// ratios is nullopt.
std::optional<Estimate> geometric_ratio(std::span<const double> a, std::span<const double> b);

// Returns the arithmetic mean; the interval of a single value is (-infinity, infinity).
std::optional<Estimate> mean(std::span<const double> values);

struct TimeError {
  double seconds = 0, error = 0;
};
// Returns the exponent s of error ~ seconds^-s, fitted by least squares through the logarithms of the points;
// it is 1 for independent samples. nullopt: fewer than three points have positive time and error, or all of
// them have the same time.
std::optional<double> log_slope(std::span<const TimeError> points);

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
