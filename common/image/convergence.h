// How an image's error falls with time, and when it will have fallen far enough: a line through log error
// over log time, and its continuation.
//
// Checkpoints share samples: the one at n samples is part of the one at m > n. With independent samples the
// half difference D at m is the n-th part's, weighted n/m, and more that is independent, so corr(D_n, D_m) =
// sqrt(n/m), and for Gaussian D the estimates, sums of D^2, have the correlation n/m. Their logarithms are
// fitted by generalised least squares (Aitken 1936) with that covariance; leaving it out would make the
// interval of the slope far too narrow. The variance of one estimate is half of that of its interval: an
// interval for the realised error adds the variance of what was realised, which is as large
// (error_estimate.h). Checkpoints are taken at doubling samples only: those between them add hardly anything.
#pragma once

#include <optional>
#include <span>
#include <string>

namespace ls {

struct ErrorPoint {
  double spp = 0;
  double core_seconds = 0;  // that rendering its samples took
  double relmse = 0, relmse_lo = 0, relmse_hi = 0;
  std::optional<double> true_relmse = {};  // against a reference
  // Of true_relmse, by what is left of the reference's own noise (reference.h); nothing: it is not known.
  std::optional<double> true_stderr = {};
};

// relMSE ~ time^-slope; 1 for independent samples of finite variance.
struct Trend {
  int points = 0;                                // checkpoints it is drawn from
  double slope = 0, slope_lo = 0, slope_hi = 0;  // with a 95 % interval
  std::string verdict;                           // in words
};
// Points in order of samples. Nothing: fewer than three of them can be used.
std::optional<Trend> trend_of(std::span<const ErrorPoint> points);

// What is to be thought of an image's figures, in one word and in a sentence.
struct Judgement {
  enum class Kind {
    early,       // too few checkpoints to say
    converging,  // as expected: like 1/N
    fast,        // faster than 1/N: low-discrepancy points on a smooth image
    heavy_tail,  // don't trust yet: few pixels carry the error, or it falls slower than 1/N
    bias_floor,  // with a reference: the true error stays while the estimated one falls
  } kind = Kind::early;
  std::string words;
  bool trusted = true;  // false: the figures may be far off ("don't trust yet")
  bool operator==(const Judgement&) const = default;
};
const char* to_string(Judgement::Kind kind);
// `doubt`: ImageError::verdict, empty when the image's own figures are trusted. In order of weight: doubt, a
// bias floor, the slope.
//
// Bias floor: of the true error that part which the estimated one lacks is a squared bias, if it is there,
// and does not fall with samples; what chance puts between the two falls as they do, but for what the
// reference's own noise puts there: that stays, too. It is told where the last true error is above the
// estimated one by four standard deviations of the interval's logarithm and of the reference's noise together
// (chance: once in 30,000), and has kept more of its excess since half the samples or fewer than the root of
// their ratio, which is half way between staying and falling like 1/N.
Judgement judge(std::span<const ErrorPoint> points, const std::string& doubt);

struct Forecast {
  double spp = 0;                                                     // at the target
  double core_seconds = 0, core_seconds_lo = 0, core_seconds_hi = 0;  // still to spend; 95 % interval
};
// Until the estimated relMSE is down to `target`, at the end of a round. Zeros: it is already. Nothing: there
// is no point with a positive error and time. The slope is the fitted one, drawn to 1 as far as the points
// leave it open (a Gaussian prior of standard deviation .15).
//
// Slopes change: what low-discrepancy points gain on smooth parts of an image is used up sooner or later, and
// a slope of 1.2 at 4 samples has become 1.0 at 256 (the bench scene `tint`). A straight line through all
// doublings would go on too steeply, and the more surely so the better the points are known. So the slope
// strays like a Brownian motion of log time, by .05 a doubling (kBend = .05 / sqrt(log 2)): a local linear
// trend (Harvey 1989, chapter 2.3). Counted from the last point, that adds b^2 u^2 (3 v - u) / 6 to the
// covariance of the points at times u <= v before it, and b^2 u^3 / 3 to the variance u after it.
std::optional<Forecast> forecast_of(std::span<const ErrorPoint> points, double target);

}  // namespace ls
