#include "core/image/error/convergence.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "core/image/frame/rounds.h"
#include "tests/support/significance.h"

namespace ls {
namespace {

using ::testing::HasSubstr;

// Simulates a job of `pixels` grey pixels with Gaussian halves, and returns the checkpoints that the error
// estimate would give. Time is proportional to the number of samples. The variance of a mean of n samples is
// n^-slope.
class Job {
 public:
  // `early`: the error at spp samples is larger by a factor of 1 + early / spp^(3/4), so that it falls faster
  // at first.
  Job(int pixels, std::uint64_t seed, double slope = 1, double early = 0)
      : slope_(slope), early_(early), sums_(static_cast<std::size_t>(pixels)), random_(seed) {}

  ErrorPoint next(std::uint64_t spp) {
    std::normal_distribution<double> normal;
    const double more = std::sqrt(variance_of_sum(spp) - variance_of_sum(spp_));
    double squares = 0, fourth = 0;
    for (double& s : sums_) {
      s += more * normal(random_);
      const double d = s / static_cast<double>(spp);
      squares += d * d;
      fourth += d * d * d * d;
    }
    spp_ = spp;
    const auto n = static_cast<double>(sums_.size()) / (1 + early_ * std::pow(spp, -.75));
    // The variance of (estimated - realised sum of squares) is 4/3 sum D^4 for grey noise (error_estimate.h).
    // The interval is symmetric in the logarithm.
    const double half = 1.959964 * std::sqrt(4 * fourth / 3) / squares;
    return {static_cast<double>(spp), 3. * static_cast<double>(spp), squares / n,
            squares / n * std::exp(-half), squares / n * std::exp(half)};
  }

 private:
  double variance_of_sum(std::uint64_t n) const {
    return n == 0 ? 0 : std::pow(static_cast<double>(n), 2 - slope_);
  }
  double slope_, early_;
  std::vector<double> sums_;
  std::uint64_t spp_ = 0;
  std::mt19937_64 random_;
};

std::vector<ErrorPoint> checkpoints(Job& job, RoundIndex rounds) {
  std::vector<ErrorPoint> points;
  for (RoundIndex k = 0; k < rounds; ++k) points.push_back(job.next(round_range(k).s1));
  return points;
}

TEST(Trend, PowerLawHasItsExponent) {
  for (const double slope : {.5, 1., 1.5}) {
    std::vector<ErrorPoint> points;
    for (double spp = 8; spp <= 1024; spp *= 2) {
      const double e = std::pow(spp, -slope);
      points.push_back({spp, 5 * spp, e, .9 * e, 1.1 * e});
    }
    const auto trend = trend_of(points);
    ASSERT_TRUE(trend);
    EXPECT_NEAR(trend->slope, slope, 1e-9);  // exact up to rounding
    EXPECT_EQ(trend->points, 8);
    EXPECT_LT(trend->slope_lo, slope);
    EXPECT_GT(trend->slope_hi, slope);
  }
}

TEST(Trend, NeedsThreeDoublings) {
  Job job(100, 1);
  // Of the checkpoints at 2, 4, 8 and 16 samples only two have the required 8 samples.
  EXPECT_FALSE(trend_of(checkpoints(job, 4)));
  Job another(100, 1);
  EXPECT_TRUE(trend_of(checkpoints(another, 5)));
  EXPECT_FALSE(trend_of({}));
}

TEST(Trend, LongJobUsesOnlyDoublings) {
  Job job(50, 3);
  const auto trend = trend_of(checkpoints(job, 5 + 32));  // up to 2048 samples
  ASSERT_TRUE(trend);
  EXPECT_EQ(trend->points, 9);  // at 2048, 1024, ..., 8 samples
}

TEST(Trend, IgnoresInvalidPoints) {
  Job job(100, 1);
  auto points = checkpoints(job, 7);
  const auto before = trend_of(points)->slope;
  points.insert(points.begin(), {{8, 0, 1, .9, 1.1},
                                 {8, 1, std::nan(""), .9, 1.1},
                                 {8, 1, 1, 0, 1},
                                 {8, 1, 0, 0, 0},
                                 {8, 1, 1, .9, INFINITY}});
  EXPECT_EQ(trend_of(points)->slope, before);
}

// Returns the tolerance for the fraction of successes in n independent trials of probability .95.
double spread(int n) { return test::kStandardErrors * std::sqrt(.95 * .05 / n); }

TEST(Trend, IntervalCoversTheTrueSlopeInNineteenOfTwentyJobs) {
  constexpr int kJobs = 1000;
  int covered = 0;
  for (int i = 0; i < kJobs; ++i) {
    Job job(400, 100 + static_cast<std::uint64_t>(i));
    const auto trend = trend_of(checkpoints(job, 9));
    covered += trend->slope_lo <= 1 && 1 <= trend->slope_hi;
  }
  // The additional .01 is for the interval's width, which is itself estimated from 400 pixels.
  EXPECT_NEAR(covered / double{kJobs}, .95, spread(kJobs) + .01);
}

TEST(Trend, DescribesTheTrendInWords) {
  Job slow(4000, 1, .6), fair(4000, 2, 1), fast(4000, 3, 1.5);
  EXPECT_THAT(trend_of(checkpoints(slow, 9))->verdict, HasSubstr("slower than 1/N"));
  EXPECT_EQ(trend_of(checkpoints(fair, 9))->verdict, "converging as expected");
  EXPECT_EQ(trend_of(checkpoints(fast, 9))->verdict, "faster than 1/N");
}

// Returns checkpoints with an estimated error of 1/N, and with a true error that exceeds it by bias^2.
std::vector<ErrorPoint> against_a_reference(double bias) {
  std::vector<ErrorPoint> points;
  for (double spp = 8; spp <= 1024; spp *= 2) {
    const double e = 1 / spp;
    points.push_back({spp, spp, e, .9 * e, 1.1 * e, e + bias * bias});
  }
  return points;
}

TEST(ConvergenceStatus, ReportsABiasFloorOnlyIfTheTrueErrorStays) {
  using Kind = ConvergenceStatus::Kind;
  EXPECT_EQ(judge(against_a_reference(0), "").kind, Kind::converging);
  // The squared bias 2.5e-5 is within the interval of the error 9.8e-4.
  EXPECT_EQ(judge(against_a_reference(.005), "").kind, Kind::converging);
  // The squared bias is 2.5e-3.
  const ConvergenceStatus floor = judge(against_a_reference(.05), "");
  EXPECT_EQ(floor.kind, Kind::bias_floor);
  EXPECT_THAT(floor.words, HasSubstr("0.0035"));
  // The true error is always twice the estimated one, but falls at the same rate: the estimate is wrong, and
  // there is no floor.
  auto falling = against_a_reference(0);
  for (ErrorPoint& p : falling) p.true_relmse = 2 * p.relmse;
  EXPECT_EQ(judge(falling, "").kind, Kind::converging);
}

// The jobs and the reference have no bias. The true error is another sample from the distribution of the
// estimated one.
TEST(ConvergenceStatus, ReportsNoFloorWithoutOne) {
  int floors = 0;
  for (std::uint64_t i = 0; i < 200; ++i) {
    Job job(400, 9000 + i), realised(400, 20000 + i);
    auto points = checkpoints(job, 9);
    const auto truth = checkpoints(realised, 9);
    for (std::size_t k = 0; k < points.size(); ++k) points[k].true_relmse = truth[k].relmse;
    floors += judge(points, "").kind == ConvergenceStatus::Kind::bias_floor;
  }
  // By chance, one of 200 jobs exceeds four standard deviations with a probability of 0.6 %.
  EXPECT_LE(floors, 1);
}

TEST(ConvergenceStatus, ShowsDoubtFirst) {
  EXPECT_EQ(judge(against_a_reference(.05), "don't trust yet: ...").kind,
            ConvergenceStatus::Kind::heavy_tail);
  EXPECT_EQ(judge({}, "").kind, ConvergenceStatus::Kind::early);
  Job slow(4000, 1, .6), fast(4000, 3, 1.5);
  const ConvergenceStatus tail = judge(checkpoints(slow, 9), "");
  EXPECT_EQ(tail.kind, ConvergenceStatus::Kind::heavy_tail);
  EXPECT_THAT(tail.words, HasSubstr("don't trust yet"));
  EXPECT_EQ(judge(checkpoints(fast, 9), "").kind, ConvergenceStatus::Kind::fast);
}

TEST(Forecast, ReachedTargetHasZeroForecast) {
  Job job(100, 1);
  const auto points = checkpoints(job, 6);
  const auto forecast = forecast_of(points, 2 * points.back().relmse);
  ASSERT_TRUE(forecast);
  EXPECT_EQ(forecast->core_seconds, 0);
  EXPECT_EQ(forecast->core_seconds_hi, 0);
}

TEST(Forecast, EndsAtTheRoundThatReachesTheTarget) {
  const std::vector<ErrorPoint> now{{64, 10, .02, .0199, .0201}};
  // This takes twice the samples, 128, where a round ends.
  const auto forecast = forecast_of(now, .01);
  ASSERT_TRUE(forecast);
  EXPECT_EQ(forecast->spp, 128);
  EXPECT_NEAR(forecast->core_seconds, 10, 1e-9);
  EXPECT_EQ(forecast_of(now, .0099)->spp, 192);
  EXPECT_FALSE(forecast_of({}, .01));
  EXPECT_FALSE(forecast_of(now, 0));
}

// Runs jobs until their estimated error reaches the target, as the farm does, with a forecast at each of
// their checkpoints. Returns the fraction of forecasts whose interval contains the time that the job then
// took.
double share_within(double slope, int jobs, int pixels, double early = 0) {
  int within = 0, all = 0;
  for (int i = 0; i < jobs; ++i) {
    Job job(pixels, 5000 + static_cast<std::uint64_t>(i), slope, early);
    std::vector<ErrorPoint> points = checkpoints(job, 6);
    const double target = points.back().relmse / 10;
    std::vector<std::pair<double, Forecast>> said;
    while (points.back().relmse > target) {
      said.emplace_back(points.back().core_seconds, *forecast_of(points, target));
      points.push_back(job.next(round_range(static_cast<RoundIndex>(points.size())).s1));
    }
    for (const auto& [at, f] : said) {
      const double took = points.back().core_seconds - at;
      // The factor allows for rounding: both ends of the interval may be the end of the same round.
      within += f.core_seconds_lo <= took && took <= f.core_seconds_hi * (1 + 1e-9);
      ++all;
    }
  }
  return within / double(all);
}

// The cost per sample varies. An interval that only took the ends of rounds into account would be too narrow,
// and the time would be just outside of it.
TEST(Forecast, AllowsForCostsThatVary) {
  std::vector<ErrorPoint> even, uneven;
  double spent = 0, before = 0;
  for (const double spp : {8., 16., 32., 64., 128.}) {
    const double error = 1 / spp;
    even.push_back({spp, spp, error, error / 1.05, error * 1.05});
    spent += (spp - before) * (even.size() % 2 == 1 ? 1.03 : .97);
    before = spp;
    uneven.push_back({spp, spent, error, error / 1.05, error * 1.05});
  }

  const auto exact = forecast_of(even, .002), wide = forecast_of(uneven, .002);

  // 1.96 standard deviations of about 3 % on each side are a factor of 1.12 between the ends. The line that
  // is fitted to the points includes the same variation, and so moves both ends by a few per cent.
  const auto factor = [](const Forecast& f) { return f.core_seconds_hi / f.core_seconds_lo; };
  EXPECT_NEAR(factor(*wide) / factor(*exact), 1.12, .04);
  EXPECT_GT(wide->core_seconds_hi, 1.03 * exact->core_seconds_hi);
  EXPECT_LT(wide->core_seconds_hi, 1.15 * exact->core_seconds_hi);
}

TEST(Forecast, HoldsInNineOfTenCases) {
  // The forecasts of one job are correlated, so the fraction is not binomial, and .95 cannot be tested
  // for. The bound .9 has a margin.
  EXPECT_GE(share_within(1, 100, 400), .9);
  EXPECT_GE(share_within(1.15, 100, 400), .9);
  EXPECT_GE(share_within(.9, 100, 400), .9);
}

// The slope is 1.18 at 8 samples, 1.08 at 32, 1.03 at 128. A straight line does not fit, and the more precise
// the points are, the more clearly its forecast is wrong.
TEST(Forecast, HoldsInNineOfTenCasesWhereTheSlopeFlattens) {
  EXPECT_GE(share_within(1, 40, 4000, 2), .9);
  EXPECT_GE(share_within(1, 40, 400, 2), .9);
}

// The interval must not be needlessly wide: if the slope is always 1, the ends for a quarter of the error
// differ by less than a factor of 2.
TEST(Forecast, IsAccurateIfTheSlopeStays) {
  Job job(4000, 1);
  const auto points = checkpoints(job, 8);
  const auto forecast = forecast_of(points, points.back().relmse / 4);
  ASSERT_TRUE(forecast);
  EXPECT_LT(forecast->core_seconds_hi / forecast->core_seconds_lo, 2);
}

}  // namespace
}  // namespace ls
