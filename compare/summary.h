// The results of a race: for each entrant its final error, its efficiency and its curve of error over time.
// All are means over the seeds (renders with different random numbers).
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
  // A mean and its 95 % interval [lo, hi]; the interval is unbounded if there is only one value.
  double value = 0, lo = 0, hi = 0;
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
// Returns the exponent s of error ~ seconds^-s, fitted by least squares through the logarithms of the points.
// For squared errors s is 1 if the samples are independent. nullopt: fewer than three points have positive
// time and error, or all of them have the same time.
std::optional<double> log_slope(std::span<const TimeError> points);

struct Row {
  std::size_t entrant = 0;
  std::size_t seeds = 0;
  double spp = 0, seconds = 0;     // samples per pixel and seconds at the end of the race (geometric means)
  std::optional<Estimate> relmse;  // final error against the reference
  std::optional<Estimate> efficiency;  // final 1 / (relMSE x seconds)
  std::optional<Estimate> slope;       // s of relMSE ~ seconds^-s, fitted to points at doubling sample counts
  // The first entrant's efficiency divided by this one's, as geometric mean over the seeds. nullopt for the
  // first entrant itself, and if an efficiency is unknown.
  std::optional<Estimate> ratio;
  // The largest final relMSE of the seeds divided by the smallest. It is large if few pixels dominate the
  // error.
  double spread = 1;
};
// Returns one row per entrant that finished, in the order of the entrants.
std::vector<Row> rows_of(const Race& race);

struct CurveAt {
  double spp = 0, seconds = 0;
  Estimate relmse;
};
// Returns the error of an entrant over time, as geometric means over the seeds: one point for each sample
// count that at least half of the seeds have reached, and one for the ends of the runs. A point is omitted if
// the error of any of its seeds is hidden by the noise of the reference.
std::vector<CurveAt> curve_of(const Race& race, std::size_t entrant);

}  // namespace ls::race
