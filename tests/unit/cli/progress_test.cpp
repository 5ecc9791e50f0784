#include "cli/output/progress.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "cli/output/console.h"

namespace ls::cli {
namespace {

using testing::HasSubstr;
using testing::Not;

TEST(ProgressLine, ShowsShareRateErrorAndTimeLeft) {
  const ProgressFigures figures{"running", .426, 27.25, 3.14e6, .01234, 42.4, ""};

  const std::string line = progress_line(figures, 120);

  EXPECT_LT(line.size(), 80u);
  EXPECT_EQ(line, " 42 % [######          ] 27.2 spp  3.14 M samples/s  relMSE 0.0123  42 s left");
}

const ProgressFigures kForecast{"running", .426, 27.25,        3.14e6,           .01234, 252,
                                "",        "",   {{186, 330}}, {{.0118, .0129}}, .001,   66};

TEST(ProgressLine, ShowsErrorAndForecastWithIntervals) {
  EXPECT_EQ(
      progress_line(kForecast, 200),
      " 42 % [######          ] 27.2 spp  3.14 M samples/s  relMSE 0.0123 (0.0118 to 0.0129), target 0.001  "
      "4:12 left "
      "(3:06 to 5:30), 1:06 with 8 more");
}

TEST(ProgressLine, HasNoBarInALog) {
  EXPECT_EQ(progress_line(kForecast, 0, false),
            " 42 % 27.2 spp  3.14 M samples/s  relMSE 0.0123 (0.0118 to 0.0129), target 0.001  4:12 left "
            "(3:06 to 5:30), 1:06 with 8 more");
}

TEST(ProgressBar, WritesALineWheneverTheWholePercentHasChanged) {
  ProgressBar bar(ProgressForm::lines);
  testing::internal::CaptureStderr();

  for (const double progress : {.0, .004, .01, .019, 1.}) bar.show({"running", progress, 100 * progress});

  EXPECT_EQ(testing::internal::GetCapturedStderr(), "  0 % 0.0 spp\n  1 % 1.0 spp\n100 % 100.0 spp\n");
}

TEST(ProgressLine, KeepsErrorAndForecastOnANarrowTerminal) {
  EXPECT_EQ(progress_line(kForecast, 90),
            " 42 % [######          ] 27.2 spp  relMSE 0.0123, target 0.001  4:12 left (3:06 to 5:30)");
  EXPECT_EQ(progress_line(kForecast, 80),
            " 42 % 27.2 spp  relMSE 0.0123, target 0.001  4:12 left (3:06 to 5:30)");
  EXPECT_EQ(progress_line(kForecast, 60), " 42 % 27.2 spp  relMSE 0.0123, target 0.001  4:12 left");
}

TEST(ProgressLine, UntrustedJobHasNoForecast) {
  ProgressFigures figures = kForecast;
  figures.doubtful = true;

  EXPECT_EQ(
      progress_line(figures, 200),
      " 42 % [######          ] 27.2 spp  3.14 M samples/s  relMSE 0.0123 (don't trust yet), target 0.001  "
      "at least 4:12 left, 1:06 with 8 more");
  EXPECT_EQ(progress_line(figures, 70),
            " 42 % 27.2 spp  relMSE 0.0123 (don't trust yet)  at least 4:12 left");
}

TEST(ProgressLine, TimeLeftOfAJobThatEndsBySamplesIsExactEvenIfUntrusted) {
  ProgressFigures figures = kForecast;
  figures.doubtful = true;
  figures.target_error.reset();

  EXPECT_EQ(progress_line(figures, 70), " 42 % 27.2 spp  relMSE 0.0123 (don't trust yet)  4:12 left");
}

TEST(ProgressLine, LeavesOutUnknownFigures) {
  const std::string line = progress_line({"queued", 0, 0, 0, {}, {}, "no worker is connected"}, 120);

  EXPECT_THAT(line, HasSubstr("queued"));
  EXPECT_THAT(line, HasSubstr("no worker is connected"));
  EXPECT_THAT(line, Not(HasSubstr("relMSE")));
  EXPECT_THAT(line, Not(HasSubstr("left")));
}

TEST(ProgressLine, FitsTheTerminal) {
  const ProgressFigures figures{"running", 1, 1e6, 1e9, 1e-9, 1e6, std::string(500, 'x')};
  for (const int columns : {20, 40, 80, 200})
    EXPECT_LT(progress_line(figures, columns).size(), static_cast<std::size_t>(columns));
}

TEST(ProgressLine, HandlesImpossibleFigures) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(progress_line({"running", nan, 1, 1, nan, nan, ""}, 120), HasSubstr("  0 % ["));
  EXPECT_THAT(progress_line({"running", 7, 1, 1, {}, {}, ""}, 120), HasSubstr("100 % [################]"));
}

TEST(Say, WritesTimesAndSizesForPeople) {
  EXPECT_EQ(show_seconds(.84), "0.8 s");
  EXPECT_EQ(show_seconds(9.97), "10 s");
  EXPECT_EQ(show_seconds(59.6), "1:00");
  EXPECT_EQ(show_seconds(187), "3:07");
  EXPECT_EQ(show_seconds(7511), "2:05:11");
  EXPECT_EQ(show_bytes(1023), "1023 B");
  EXPECT_EQ(show_bytes(3 << 20), "3.0 MiB");
}

}  // namespace
}  // namespace ls::cli
