// Tests of the advice on an image whose error figures are not trusted.
#include "core/job/advice.h"

#include <gtest/gtest.h>

#include "core/image/frame/render_limits.h"

namespace ls {
namespace {

using Kind = ConvergenceStatus::Kind;
const ConvergenceStatus kHeavy{Kind::heavy_tail, "don't trust yet: few pixels carry the error", false};

TEST(Advice, IsEmptyForTrustedFigures) {
  EXPECT_EQ(advice_on({Kind::converging, "1/N", true}, {.job = "j-1", .relmse = .1}), "");
}

TEST(Advice, NamesTheCommandThatContinuesRendering) {
  EXPECT_EQ(advice_on(kHeavy, {.job = "j-1", .relmse = .1, .spp_done = 64}),
            "still noisy: a few bright pixels carry the error; render on: lightshaft extend j-1 --spp 256");
  EXPECT_EQ(advice_on(kHeavy, {.job = "j-1", .relmse = .1, .spp_done = 2.5}),
            "still noisy: a few bright pixels carry the error; render on: lightshaft extend j-1 --spp 64");
}

TEST(Advice, SuggestsWaitingForARunningJob) {
  EXPECT_EQ(advice_on(kHeavy, {.job = "j-1", .relmse = .1, .spp_done = 64, .goes_on = true}),
            "still noisy: a few bright pixels carry the error; more samples are on their way");
}

TEST(Advice, NamesNoCommandForAJobThatCannotContinue) {
  EXPECT_EQ(advice_on(kHeavy, {.job = "j-1", .relmse = .1, .spp_done = 64, .can_extend = false}),
            "still noisy: a few bright pixels carry the error");
}

TEST(Advice, SuggestsLookingForALightIfNoneWasFound) {
  EXPECT_EQ(
      advice_on(kHeavy, {.job = "j-1", .lit = false, .spp_done = 64}),
      "no light found yet: check that a light reaches what the camera sees; render on: lightshaft extend "
      "j-1 --spp 256");
}

TEST(Advice, EqualHalvesAreNotReportedAsMissingLight) {
  EXPECT_EQ(advice_on(kHeavy, {.job = "j-1", .relmse = 0, .spp_done = 16}),
            "too few samples so far to tell the error; render on: lightshaft extend j-1 --spp 64");
}

TEST(Advice, NamesNoCommandAtTheLargestNumberOfSamples) {
  EXPECT_EQ(advice_on(kHeavy, {.job = "j-1", .relmse = .1, .spp_done = static_cast<double>(kMaxSpp)}),
            "still noisy: a few bright pixels carry the error");
}

TEST(Advice, SuggestsCheckingADisagreeingReference) {
  EXPECT_EQ(
      advice_on({Kind::bias_floor, "bias floor", false}, {.job = "j-1", .relmse = .1, .spp_done = 64}),
      "image and reference disagree, and more samples will not help: check that the reference shows this "
      "scene with this camera and these settings");
}

}  // namespace
}  // namespace ls
