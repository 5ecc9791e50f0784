// Convergence of an image's error: fits a line to log(error) as a function of log(time), and extrapolates it
// to forecast when the error will reach a target.
//
// Checkpoints share samples: the checkpoint at m samples contains the samples of the one at n < m. Let D_n be
// half the difference of the two half images at n samples. If samples are independent, D_m is (n/m) D_n plus
// an independent term, so corr(D_n, D_m) = sqrt(n/m). For Gaussian D the estimates, sums of D^2, have the
// correlation n/m. The line is fitted to their logarithms by generalised least squares (Aitken 1936) with
// this covariance; without it the slope's interval would be far too narrow. The variance of an estimate is
// half of what the width of its interval gives: the interval is for the difference of estimated and realised
// error, which both have this variance (error_estimate.h). Only checkpoints at doubling sample counts are
// used; those between them add little.
#pragma once

#include <optional>
#include <span>
#include <string>

namespace ls {

struct ErrorPoint {
  double spp = 0;
  double core_seconds = 0;  // CPU time spent rendering its samples
  double relmse = 0, relmse_lo = 0, relmse_hi = 0;
  std::optional<double> true_relmse = {};  // error against a reference
  // Standard error of true_relmse due to the reference's remaining noise (reference.h); nullopt: unknown.
  std::optional<double> true_stderr = {};
};

// The trend relMSE ~ time^-slope; the slope is 1 for independent samples of finite variance.
struct Trend {
  int points = 0;                                // number of checkpoints used
  double slope = 0, slope_lo = 0, slope_hi = 0;  // slope, and its 95 % interval
  std::string verdict;                           // the trend in words
};
// Fits the trend. `points` are in order of samples. nullopt: fewer than three points at doubling sample
// counts are usable.
std::optional<Trend> trend_of(std::span<const ErrorPoint> points);

// How far an image's error figures can be trusted, as a status and as a sentence.
struct ConvergenceStatus {
  enum class Kind {
    early,       // too few checkpoints to judge
    converging,  // as expected: the error falls like 1/N
    fast,        // faster than 1/N, as low-discrepancy points do on a smooth image
    heavy_tail,  // don't trust yet: few pixels carry the error, or it falls more slowly than 1/N
    bias_floor,  // with a reference: the true error is constant while the estimated one falls
  } kind = Kind::early;
  std::string words;
  bool trusted = true;  // false: the figures may be far off
  bool operator==(const ConvergenceStatus&) const = default;
};
const char* to_string(ConvergenceStatus::Kind kind);
// Judges an image's convergence. `doubt` is ImageError::verdict, empty if the image's own figures are
// trusted. If there are several reasons for distrust, the first in this order is given: `doubt`, a bias
// floor, the slope. A bias floor is a squared bias: the part of the true error that the estimated one lacks
// and that does not fall with samples. Random differences between the two errors fall with samples, except
// for the reference's own noise, which is constant as well. A floor is reported if two conditions hold:
// - The latest true error exceeds the estimated one by four standard deviations (by chance: once in 30,000).
//   This standard deviation combines two in quadrature: that of the estimate, from its interval on a
//   logarithmic scale, and ErrorPoint::true_stderr, due to the noise of the reference.
// - The excess falls more slowly than 1 / sqrt(N), which is half way between a constant and 1/N. To test
//   this, it is compared with the excess at the latest checkpoint that had at most half the samples.
ConvergenceStatus judge(std::span<const ErrorPoint> points, const std::string& doubt);

struct Forecast {
  double spp = 0;  // mean samples per pixel at which the target is reached
  // Core seconds still needed, with their 95 % interval
  double core_seconds = 0, core_seconds_lo = 0, core_seconds_hi = 0;
};
// Forecasts the samples and time until the estimated relMSE reaches `target`, rounded up to a whole round
// (range of samples). Core seconds of 0: the target has been reached. nullopt: no forecast is possible, for
// example because the last point has fewer than 8 samples per pixel, no error above 0, or no time. The slope
// is fitted with a Gaussian prior of mean 1 and standard deviation 0.15.
//
// Slopes change: the gain of low-discrepancy points on smooth parts of an image is used up eventually, and a
// slope of 1.2 at 4 samples becomes 1.0 at 256 (the bench scene `tint`). A straight line through all
// doublings would be too steep and have too narrow an interval. So the slope is modelled as a Brownian
// motion in log time with a standard deviation of 0.05 per doubling: a local linear trend (Harvey 1989,
// chapter 2.3). Let b = .05 / sqrt(log 2) (kBend), and let u and v be log times counted from the last point.
// The motion adds b^2 u^2 (3 v - u) / 6 to the covariance of two points at u <= v before the last one, and
// b^2 u^3 / 3 to the variance of a prediction at u after it.
std::optional<Forecast> forecast_of(std::span<const ErrorPoint> points, double target);

}  // namespace ls
