// Figures over seeds. Errors, times and efficiencies are positive and spread by factors, so they are averaged
// as logarithms: the mean is the geometric one, and its 95 % interval is Student's t over the seeds, which
// are independent renders.
#pragma once

#include <optional>
#include <span>

namespace ls::race {

struct Estimate {
  double value = 0, lo = 0, hi = 0;  // 95 % interval; of a single value the widest there is
};

// Geometric mean of positive values; interval (0, infinity) if there is one only. Nothing: there is none, or
// one is not a positive finite number.
std::optional<Estimate> geometric_mean(std::span<const double> values);

// Geometric mean of a[i] / b[i]. What both have in common at one i (the machine's mood at that time) cancels.
// Nothing: the counts differ, or as above.
std::optional<Estimate> geometric_ratio(std::span<const double> a, std::span<const double> b);

// Arithmetic mean; interval (-infinity, infinity) if there is one value only.
std::optional<Estimate> mean(std::span<const double> values);

struct TimeError {
  double seconds = 0, error = 0;
};
// s of error ~ seconds^-s, by least squares through the logarithms; 1 for independent samples. Nothing: fewer
// than three points with both positive, or all at one time.
std::optional<double> log_slope(std::span<const TimeError> points);

}  // namespace ls::race
