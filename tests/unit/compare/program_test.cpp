// Programs that end well, badly, or not at all.
#include "compare/program.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <stdlib.h>

#include <filesystem>
#include <thread>

namespace ls::race {
namespace {

using testing::HasSubstr;

constexpr double kPatient = 60;

Result<Cost> shell(const std::string& script, double most = kPatient, bool stopped = false) {
  const SystemClock clock;
  const std::atomic<bool> stop{stopped};
  return run_program({{"sh", "-c", script}, most}, clock, stop);
}

TEST(Programs, CostWallAndCpuTime) {
  const auto busy = shell("i=0; while [ $i -lt 100000 ]; do i=$((i+1)); done");

  ASSERT_TRUE(busy) << busy.error().message;
  EXPECT_GT(busy->cpu, 0);
  EXPECT_GT(busy->wall, 0);
  EXPECT_LE(busy->cpu, busy->wall + .1);  // one thread; clocks of different grain
}

TEST(Programs, ThatFailAreQuoted) {
  const auto failed = shell("echo starting; echo 'no such light' >&2; echo; exit 3");

  EXPECT_EQ(failed.error().message, "sh ended with exit code 3; its last words: no such light");
}

TEST(Programs, ThatDieAreToldBySignal) {
  EXPECT_THAT(shell("kill -SEGV $$").error().message, HasSubstr("signal 11"));
}

TEST(Programs, ThatDoNotExistAreNamed) {
  const SystemClock clock;
  const std::atomic<bool> stop{false};
  const auto none = run_program({{"lightshaft-no-such-program"}, kPatient}, clock, stop);

  EXPECT_THAT(none.error().message, HasSubstr("lightshaft-no-such-program"));
}

TEST(Programs, ThatDoNotEndAreEndedWithWhatTheyStarted) {
  const auto mark = std::filesystem::path(testing::TempDir()) / ("race-mark-" + std::to_string(::getpid()));
  const auto late = shell("(tail -f /dev/null; touch '" + mark.string() + "') & echo mine; wait", .2);

  EXPECT_EQ(late.error().code, Errc::resource_exhausted);
  EXPECT_THAT(late.error().message, HasSubstr("more than 0.2 s"));
  EXPECT_THAT(late.error().message, HasSubstr("mine"));
  EXPECT_FALSE(std::filesystem::exists(mark));
}

// One that leaves a child behind, which holds its output open, has ended all the same.
TEST(Programs, LeaveNobodyBehind) {
  const auto ok = shell("tail -f /dev/null & exit 0");

  EXPECT_TRUE(ok) << ok.error().message;
}

TEST(Programs, FloodsOfOutputAreOnlyKeptInPart) {
  const auto loud = shell(
      "i=0; while [ $i -lt 3000 ]; do echo 'a line of some length that says nothing at all'; i=$((i+1)); "
      "done; exit 1");

  EXPECT_THAT(loud.error().message,
              HasSubstr("its last words: a line of some length that says nothing at all"));
}

TEST(Programs, EndWhenTheUserWantsIt) {
  EXPECT_EQ(shell("tail -f /dev/null", kPatient, true).error().code, Errc::failed_precondition);
}

TEST(Programs, SeeNoTokens) {
  ::setenv("LIGHTSHAFT_TOKEN", "secret", 1);
  const auto seen = shell("echo \"token [$LIGHTSHAFT_TOKEN]\"; exit 1");
  ::unsetenv("LIGHTSHAFT_TOKEN");

  EXPECT_THAT(seen.error().message, HasSubstr("token []"));
}

}  // namespace
}  // namespace ls::race
