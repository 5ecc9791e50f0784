// How an image's error falls with time, and when it will be low enough: a regression line of log error over
// log time, and its extrapolation.
//
// Checkpoints share samples: the checkpoint at m samples contains the samples of the one at n < m. Let D_n be
// the half difference at n. With independent samples D_m is (n/m) D_n plus an independent rest, so corr(D_n,
// D_m) = sqrt(n/m). For Gaussian D the estimates, sums of D^2, have the correlation n/m. Their logarithms are
// fitted by generalised least squares (Aitken 1936) with this covariance; without it the slope's interval
// would be far too narrow. The variance of one estimate is half of the variance that its interval shows: the
// interval is for the realised error, so it also contains the variance of the realised error, which is as
// large (error_estimate.h). Only checkpoints at doubling sample counts are used; those between them add
// little.
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
  double slope = 0, slope_lo = 0, slope_hi = 0;  // slope with its 95 % interval
  std::string verdict;                           // the trend in words
};
// Fits the trend. `points` are in order of samples. nullopt: fewer than three of them are usable.
std::optional<Trend> trend_of(std::span<const ErrorPoint> points);

// How far an image's error figures can be trusted, as a status and as a sentence.
struct ConvergenceStatus {
  enum class Kind {
    early,       // too few checkpoints to judge
    converging,  // as expected: the error falls like 1/N
    fast,        // faster than 1/N, as low-discrepancy points do on a smooth image
    heavy_tail,  // not to be trusted yet: few pixels carry the error, or it falls more slowly than 1/N
    bias_floor,  // with a reference: the true error stays while the estimated one falls
  } kind = Kind::early;
  std::string words;
  bool trusted = true;  // false: the figures may be far off
  bool operator==(const ConvergenceStatus&) const = default;
};
const char* to_string(ConvergenceStatus::Kind kind);
// Judges an image's convergence. `doubt` is ImageError::verdict, empty if the image's own figures are
// trusted. If there are several reasons for distrust, the first one in this order is given: `doubt`, a bias
// floor, the slope. A bias floor is a squared bias: the part of the true error that the estimated one lacks
// and that does not fall with samples. Random differences between the two errors fall with samples, except
// for the reference's own noise, which stays as well. A floor is reported if two conditions hold:
// - The latest true error exceeds the estimated one by four standard deviations (by chance: once in 30,000).
//   The standard deviation combines the estimate's, from its interval on a logarithmic scale, and the noise
//   of the reference.
// - The excess falls more slowly than 1 / sqrt(N), which is half way between staying and falling like 1/N.
//   It is compared with the latest checkpoint that had at most half the samples.
ConvergenceStatus judge(std::span<const ErrorPoint> points, const std::string& doubt);

struct Forecast {
  double spp = 0;  // mean samples per pixel at which the target is reached
  // Core seconds still needed, with their 95 % interval
  double core_seconds = 0, core_seconds_lo = 0, core_seconds_hi = 0;
};
// Forecasts what is needed until the estimated relMSE reaches `target`, rounded up to a whole round (range of
// samples). Core seconds of 0: the target has been reached. nullopt: no point has a positive error and time.
// The slope is the fitted one, moved towards 1 as far as the points leave it open (a Gaussian prior of mean 1
// and standard deviation 0.15).
//
// Slopes change: the gain of low-discrepancy points on smooth parts of an image is used up eventually, and a
// slope of 1.2 at 4 samples becomes 1.0 at 256 (the bench scene `tint`). A straight line through all
// doublings would continue too steeply, and the better the points are known the more confidently it would do
// so. So the slope is modelled as a Brownian motion in log time with a standard deviation of 0.05 per
// doubling (kBend = .05 / sqrt(log 2)): a local linear trend (Harvey 1989, chapter 2.3). With time counted
// from the last point, this adds b^2 u^2 (3 v - u) / 6 to the covariance of the points at times u <= v before
// it, and b^2 u^3 / 3 to the variance at u after it.
std::optional<Forecast> forecast_of(std::span<const ErrorPoint> points, double target);

}  // namespace ls
