// When a job ends if its target error is that of its denoised layers.
#include "coordinator/domain/adaptive_stop.h"

#include <gtest/gtest.h>

#include <functional>
#include <optional>
#include <vector>

namespace ls::coordinator {
namespace {

using Answer = DenoisedTarget::Answer;

constexpr double kRuleTarget = 1e-3;

// Goes through the levels of the stop rule until the job ends or no level is left; `at_most` gives the result
// of each check. Returns the samples per pixel of the levels that were checked.
std::vector<double> checked(DenoisedTarget& rule, const std::vector<double>& levels, double target,
                            const std::function<std::optional<double>(double spp)>& at_most,
                            bool* ended = nullptr) {
  std::vector<double> out;
  for (const double spp : levels) {
    Answer answer = rule.judge(spp, target);
    if (answer == Answer::check) {
      out.push_back(spp);
      rule.add({spp, 0, at_most(spp)});
      answer = rule.judge(spp, target);
      EXPECT_NE(answer, Answer::check) << "it is known";
    }
    if (ended != nullptr) *ended = answer == Answer::end;
    if (answer == Answer::end) return out;
  }
  return out;
}

std::vector<double> levels() {
  std::vector<double> spp;
  for (double n = 64; n < 2000; n *= 1.09) spp.push_back(n);
  return spp;
}

TEST(DenoisedTarget, EndsAtTheSecondCheckInSuccessionThatMeetsTheTarget) {
  const std::vector<double> errors = {2e-3, 0.5e-3, 1.5e-3, 0.9e-3, 0.8e-3, 0.1e-3};
  std::size_t next = 0;
  DenoisedTarget rule;
  bool ended = false;

  const auto at = checked(
      rule, levels(), kRuleTarget, [&](double) { return errors.at(next++); }, &ended);

  EXPECT_TRUE(ended);
  EXPECT_EQ(at.size(), 5u) << "the second one was lucky";
}

TEST(DenoisedTarget, ChecksAreFarApartAndIndependentOfTheTarget) {
  DenoisedTarget rule, other;
  const auto at = checked(rule, levels(), kRuleTarget, [](double spp) { return 1 / spp; });
  const auto there = checked(other, levels(), kRuleTarget / 1e6, [](double) { return 1.; });

  ASSERT_GT(at.size(), 5u);
  for (std::size_t i = 0; i < at.size(); ++i) {
    EXPECT_EQ(at[i], there[i]);
    if (i == 0) continue;
    EXPECT_GE(at[i], 1.4 * at[i - 1]);
  }
  EXPECT_EQ(at.front(), 64);
}

TEST(DenoisedTarget, CheckWithoutAnIntervalDoesNotMeetTheTarget) {
  DenoisedTarget rule;
  bool ended = true;
  checked(
      rule, levels(), kRuleTarget, [](double) { return std::nullopt; }, &ended);
  EXPECT_FALSE(ended);
}

TEST(DenoisedTarget, LoweredTargetContinuesFromTheOldTargetsLevel) {
  const auto error = [](double spp) { return 1 / spp; };
  DenoisedTarget at_once, raised;
  bool ended = false;
  const auto expected = checked(at_once, levels(), kRuleTarget, error, &ended);
  ASSERT_TRUE(ended);

  auto found = checked(raised, levels(), 4 * kRuleTarget, error);
  std::vector<double> rest;
  for (const double spp : levels())
    if (spp >= found.back()) rest.push_back(spp);
  const auto more = checked(raised, rest, kRuleTarget, error, &ended);
  found.insert(found.end(), more.begin(), more.end());

  EXPECT_TRUE(ended);
  EXPECT_EQ(found, expected);
}

TEST(DenoisedTarget, StoredChecksDecideAgainAfterARestart) {
  DenoisedTarget first;
  bool ended = false;
  const auto at = checked(
      first, levels(), kRuleTarget, [](double spp) { return 1 / spp; }, &ended);
  std::vector<DenoisedCheck> stored;
  for (const double spp : at) stored.push_back({spp, 0, 1 / spp});
  DenoisedTarget restored(stored);

  const auto again = checked(
      restored, levels(), kRuleTarget, [](double) { return 1.; }, &ended);

  EXPECT_TRUE(ended);
  EXPECT_TRUE(again.empty());
}

TEST(DenoisedTarget, ForecastsAtLeastOneFurtherCheck) {
  DenoisedTarget rule;
  ASSERT_EQ(rule.judge(64, kRuleTarget), Answer::check);
  rule.add({64, 0, kRuleTarget / 2});
  ASSERT_EQ(rule.judge(64, kRuleTarget), Answer::go_on);
  EXPECT_DOUBLE_EQ(rule.error_left(kRuleTarget), 1 / 1.4);
  EXPECT_DOUBLE_EQ(rule.error_left(kRuleTarget / 20), .1);
}

}  // namespace
}  // namespace ls::coordinator
