// Convergence of an image's error: fits a line to log(error) as a function of log(time), and extrapolates it
// to forecast when the error will reach a target. A checkpoint is the state of the image after some number of
// samples per pixel; an ErrorPoint has its error figures.
//
// Checkpoints share samples: the checkpoint at m samples contains the samples of the one at n < m. Let D_n be
// half the difference of the two half images at n samples. If samples are independent, D_m is (n/m) D_n plus
// an independent term, so corr(D_n, D_m) = sqrt(n/m). The error estimates are sums of D^2; for Gaussian D the
// estimates at n and m have the correlation n/m. The line is fitted to the logarithms of the estimates by
// generalised least squares (Aitken 1936) with this covariance; without it the slope's interval would be far
// too narrow. An ErrorPoint has an interval for the difference of the estimated and the realised error, which
// have equal variances (error_estimate.h). So the variance of an estimate is half of the variance that the
// width of this interval gives. Only checkpoints at doubling sample counts are used; those between them add
// little.
#pragma once

#include <optional>
#include <span>
#include <string>

namespace ls {

struct ErrorPoint {
  double spp = 0;
  double core_seconds = 0;  // CPU seconds spent rendering the samples
  double relmse = 0, relmse_lo = 0, relmse_hi = 0;
  std::optional<double> true_relmse = {};  // relMSE measured against a reference image; nullopt: unknown
  // Standard error of true_relmse due to the reference's remaining noise (reference.h); nullopt: unknown.
  std::optional<double> true_stderr = {};
};

// The trend relMSE ~ time^-slope. The slope is 1 for independent samples of finite variance.
struct Trend {
  int points = 0;                                // number of checkpoints to which the line is fitted
  double slope = 0, slope_lo = 0, slope_hi = 0;  // slope, and its 95 % interval
  std::string verdict;                           // the trend in words
};
// Fits the trend. `points` must be in order of samples. nullopt: fewer than three usable points at doubling
// sample counts.
std::optional<Trend> trend_of(std::span<const ErrorPoint> points);

// How far an image's error figures can be trusted, as a status and as a sentence.
struct ConvergenceStatus {
  enum class Kind {
    early,       // too few checkpoints to judge
    converging,  // as expected: the error falls like 1/N, where N is the number of samples
    fast,        // the error falls faster than 1/N, as low-discrepancy points do on a smooth image
    heavy_tail,  // don't trust yet: few pixels carry the error, or it falls more slowly than 1/N
    bias_floor,  // with a reference: the true error is constant while the estimated one falls
  } kind = Kind::early;
  std::string words;
  bool trusted = true;  // false: the figures may be far off
  bool operator==(const ConvergenceStatus&) const = default;
};
const char* to_string(ConvergenceStatus::Kind kind);
// Judges an image's convergence. `doubt` is ImageError::verdict, which is empty if the image's own figures
// are trusted. If there are several reasons for distrust, the first of these is given: `doubt`, a bias floor,
// the slope. A bias floor is a squared bias: a part of the true error that is missing in the estimated error
// and does not fall with the number of samples N. Random differences between the two errors do fall with N,
// except for the noise of the reference itself, which is constant. A floor is reported if two conditions
// hold:
// - The latest true error exceeds the estimated one by four standard deviations (by chance: once in 30,000).
//   This standard deviation combines two in quadrature: that of the estimate, from its interval on a
//   logarithmic scale, and ErrorPoint::true_stderr, due to the noise of the reference.
// - The excess falls more slowly than 1 / sqrt(N), which is half way between a constant and 1/N. To test
//   this, the latest excess is compared with the excess at the latest checkpoint that had at most half the
//   samples.
ConvergenceStatus judge(std::span<const ErrorPoint> points, const std::string& doubt);

struct Forecast {
  double spp = 0;  // samples per pixel, averaged over pixels, at which the target is reached
  // core seconds (CPU time) still needed, with their 95 % interval
  double core_seconds = 0, core_seconds_lo = 0, core_seconds_hi = 0;
};
// Forecasts the number of samples and the core seconds until the estimated relMSE reaches `target`. The
// number of samples is rounded up to a whole round. Core seconds of 0 mean that the target has been reached.
// nullopt: no forecast is possible, for example because the last point has fewer than 8 samples per pixel, an
// error of 0, or a time of 0. The slope is fitted with a Gaussian prior of mean 1 and standard deviation
// 0.15.
//
// Slopes change: low-discrepancy points gain on smooth parts of an image only at first, and a slope of 1.2 at
// 4 samples becomes 1.0 at 256 (the bench scene `tint`). A straight line through all doublings would be too
// steep and have too narrow an interval. So the slope is modelled as a Brownian motion in log time with a
// standard deviation of 0.05 per doubling: a local linear trend (Harvey 1989, chapter 2.3). Let b = .05 /
// sqrt(log 2) (kBend), and let u and v be log times counted from the last point. The motion adds to the
// covariance of two points at u <= v before the last one
//   b^2 u^2 (3 v - u) / 6,
// and to the variance of a prediction at u after the last point
//   b^2 u^3 / 3.
std::optional<Forecast> forecast_of(std::span<const ErrorPoint> points, double target);

}  // namespace ls
