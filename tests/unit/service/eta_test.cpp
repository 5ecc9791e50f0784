// Predictions of when a job will be done: which end comes first, and what is unknown.
#include "coordinator/service/state/job_views.h"

#include <gtest/gtest.h>

#include <vector>

namespace ls::coordinator {
namespace {

// A curve with relMSE 1 / spp, at .01 core seconds per sample: the relMSE is 1e-3 after 10 core seconds.
std::vector<ErrorPoint> points(double last) {
  std::vector<ErrorPoint> all;
  for (double n = 2; n <= last; n *= 2) all.push_back({n, n / 100, 1 / n, .95 / n, 1.05 / n});
  return all;
}

// The job has 256 samples and has used 2.56 core seconds. It needs 7.44 more to the target, and about 30 to
// the sample limit.
EtaInputs facts() {
  EtaInputs f;
  f.done = 256. / 3300;
  f.core_seconds = 2.56;
  f.core_left = 1;  // the scheduler's own prediction for an adaptive job
  f.core_to_limit = 30;
  f.target = 1e-3;
  f.elapsed = 2;
  f.cores = 2;
  return f;
}

TEST(Eta, EtaOfATargetIsItsForecastWithAnInterval) {
  const auto forecast = forecast_of(points(256), 1e-3);
  ASSERT_TRUE(forecast);
  const Eta out = eta_of(facts(), points(256));
  ASSERT_TRUE(out.seconds && out.ci95);
  EXPECT_DOUBLE_EQ(*out.seconds, forecast->core_seconds / 2);
  EXPECT_DOUBLE_EQ(out.ci95->first, forecast->core_seconds_lo / 2);
  EXPECT_DOUBLE_EQ(out.ci95->second, forecast->core_seconds_hi / 2);
  EXPECT_NEAR(*out.seconds, 7.44 / 2, 1) << "about what the points say";
  EXPECT_LT(out.ci95->first, *out.seconds);
  EXPECT_GT(out.ci95->second, *out.seconds);
  EXPECT_DOUBLE_EQ(out.progress, 256 / forecast->spp);
}

TEST(Eta, SubtractsTimeSpentSinceTheLastCheckpoint) {
  EtaInputs later = facts();
  later.core_seconds += 2;
  const Eta before = eta_of(facts(), points(256)), after = eta_of(later, points(256));
  EXPECT_DOUBLE_EQ(*after.seconds, *before.seconds - 1);
  EXPECT_DOUBLE_EQ(after.ci95->second, before.ci95->second - 1);
  later.core_seconds += 1000;
  EXPECT_EQ(eta_of(later, points(256)).seconds, 0);
}

TEST(Eta, SampleLimitEndsItBeforeAFarTarget) {
  EtaInputs f = facts();
  f.core_left = f.core_to_limit = 3;
  const Eta out = eta_of(f, points(256));
  EXPECT_EQ(out.seconds, 1.5);
  EXPECT_FALSE(out.ci95) << "of the samples the count is known";
  const auto forecast = forecast_of(points(256), 1e-3);
  f.core_to_limit = (forecast->core_seconds + forecast->core_seconds_hi) / 2;
  EXPECT_DOUBLE_EQ(eta_of(f, points(256)).ci95->second, f.core_to_limit / 2);
}

TEST(Eta, UsesPredictedCostsUntilThereAreCheckpoints) {
  const Eta out = eta_of(facts(), {});
  EXPECT_EQ(out.seconds, .5);
  EXPECT_FALSE(out.ci95);
  EXPECT_DOUBLE_EQ(out.progress, facts().done);
}

TEST(Eta, IsUnknownWithoutMeasurementsOrWorkers) {
  EtaInputs f = facts();
  f.cores = 0;
  EXPECT_FALSE(eta_of(f, points(256)).seconds);
  EXPECT_FALSE(eta_of({}, {}).seconds);
}

TEST(Eta, TimeLimitNeedsNoForecast) {
  EtaInputs f = facts();
  f.time = 2.5;
  f.cores_with_more = 10;
  const Eta out = eta_of(f, points(256));
  EXPECT_EQ(out.seconds, .5);
  EXPECT_FALSE(out.ci95);
  EXPECT_FALSE(out.with_more) << "more workers do not turn the clock";
  EXPECT_DOUBLE_EQ(out.progress, 2 / 2.5);
  f.time = 100;
  EXPECT_TRUE(eta_of(f, points(256)).ci95) << "the target comes first";
}

TEST(Eta, WithMoreWorkersIsShorterInProportion) {
  EtaInputs f = facts();
  EXPECT_FALSE(eta_of(f, points(256)).with_more) << "they would not help";
  f.cores_with_more = 10;
  const Eta out = eta_of(f, points(256));
  EXPECT_DOUBLE_EQ(*out.with_more, *out.seconds / 5);
  EXPECT_DOUBLE_EQ(out.with_more_ci95->second, out.ci95->second / 5);
}

// With 1.5 core seconds left in four units, a fifth thread has nothing to do, and the time is never less than
// that of one unit.
TEST(Eta, ThreadsBeyondTheRemainingUnitsDoNotHelp) {
  EtaInputs f;
  f.core_left = 1.5;
  f.unit_seconds = 1.5 / 4;
  f.cores = 1;
  f.cores_with_more = 9;
  const Eta out = eta_of(f, {});
  EXPECT_DOUBLE_EQ(*out.seconds, 1.5);
  EXPECT_DOUBLE_EQ(out.with_more.value(), 1.5 / 4);
  f.cores = 4;
  EXPECT_DOUBLE_EQ(*eta_of(f, {}).seconds, 1.5 / 4);
  EXPECT_FALSE(eta_of(f, {}).with_more) << "all four are under way";
}

// The number of units that a target needs is not known. At the end, threads wait for the last needed unit;
// this unit itself may have waited for a thread that rendered a unit that was not needed. Together the wait
// is at most twice a unit's time. With one thread there is no wait.
TEST(Eta, TargetIncludesTheWaitForTheLastUnit) {
  EtaInputs f = facts();
  f.cores = 4;
  const Eta even = eta_of(f, points(256));
  f.unit_seconds = .8;
  const Eta out = eta_of(f, points(256));
  EXPECT_DOUBLE_EQ(*out.seconds, *even.seconds + .5 * .75 * .8);
  EXPECT_DOUBLE_EQ(out.ci95->first, even.ci95->first);
  EXPECT_DOUBLE_EQ(out.ci95->second, even.ci95->second + 2 * .75 * .8);
  f.cores = 1;
  EXPECT_DOUBLE_EQ(*eta_of(f, points(256)).seconds, 4 * *even.seconds);
}

// With any wait the time is at most that of one thread alone.
TEST(Eta, IsZeroWithoutRemainingWork) {
  EtaInputs f = facts();
  f.cores = 4;
  f.unit_seconds = .8;
  f.core_seconds += 1000;
  EXPECT_EQ(eta_of(f, points(256)).seconds, 0);
  EXPECT_EQ(eta_of(f, points(256)).ci95->second, 0);
}

TEST(Eta, ThreadsBeyondTheUnitLimitDoNotHelp) {
  EtaInputs f;
  f.core_left = 64;
  f.unit_seconds = 1;
  f.units_at_once = 4;
  f.cores = 2;
  f.cores_with_more = 18;
  EXPECT_DOUBLE_EQ(*eta_of(f, {}).seconds, 32);
  EXPECT_DOUBLE_EQ(eta_of(f, {}).with_more.value(), 16);
  f.cores = 16;
  EXPECT_DOUBLE_EQ(*eta_of(f, {}).seconds, 16);
  EXPECT_FALSE(eta_of(f, {}).with_more);
}

TEST(Eta, PartlyRenderedUnitCountsByItsRest) {
  EtaInputs f;
  f.core_left = .25;
  f.unit_seconds = 1;
  f.cores = 8;
  EXPECT_DOUBLE_EQ(*eta_of(f, {}).seconds, .25);
  f.cores = .5;  // the job gets half a core of a worker that it shares with other jobs
  EXPECT_DOUBLE_EQ(*eta_of(f, {}).seconds, .5);
}

// Each end of the interval assumes as many cores as help it.
TEST(Eta, IntervalContainsItsEstimateEvenWithFewUnits) {
  EtaInputs f = facts();
  f.unit_seconds = 3;
  f.cores = 16;
  f.cores_with_more = 32;
  const auto forecast = forecast_of(points(256), 1e-3);
  const Eta out = eta_of(f, points(256));
  EXPECT_DOUBLE_EQ(*out.seconds, 3) << "of about 7 core seconds";
  EXPECT_DOUBLE_EQ(out.ci95->first, std::min(3., forecast->core_seconds_lo));
  EXPECT_DOUBLE_EQ(out.ci95->second, forecast->core_seconds_hi / 16 + 2 * 3 * (1 - 1. / 16));
  EXPECT_GE(out.ci95->second, *out.seconds);
}

}  // namespace
}  // namespace ls::coordinator
