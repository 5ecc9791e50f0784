#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "cli/output/convergence_text.h"
#include "core/job/health_notes.h"

namespace ls::cli {
namespace {

using nlohmann::json;

json job_with(const Health& health, std::optional<std::uint32_t> frame = {}) {
  auto notes = health_notes(health, "lightshaft render a.xml");
  for (HealthNote& n : notes) n.frame = frame;
  return {{"health", json::parse(health_json(health, notes))}};
}

TEST(HealthLines, ShowCausePlaceAndCommand) {
  Health health;
  health.add(HealthCause::infinite, 2, {3, 4, 5});
  health.add(HealthCause::negative_texel, 1);

  EXPECT_TRUE(unclean(job_with(health)));
  EXPECT_THAT(health_lines(job_with(health)),
              testing::ElementsAre("2 samples were infinite; they count as zero; first at pixel 3,4 sample 5",
                                   "  see it again: lightshaft render a.xml --pixel 3,4 --sample 5",
                                   "1 negative texel of the scene was made 0"));
  EXPECT_THAT(health_lines(job_with(health, 12))[0], testing::HasSubstr("first in frame 12 at pixel 3,4"));
}

TEST(HealthLines, AreEmptyWithoutProblemsOrData) {
  for (const json& job :
       {job_with({}), json::object(), json{{"health", 3}}, json{{"health", {{"causes", "x"}}}}}) {
    EXPECT_TRUE(health_lines(job).empty()) << job;
    EXPECT_FALSE(unclean(job)) << job;
  }
}

// Whatever a farm answers, no line contains control characters, and the number of lines is limited.
TEST(HealthLines, HandleAnyAnswerOfAFarm) {
  json causes = json::array();
  const json cause =
      json::parse(R"({"text":"a\u001b[2J\nb","first":[{"pixel":"x","sample":1}],"replay":"c\nrm x"})");
  for (int i = 0; i < 1000; ++i) causes.push_back(cause);
  causes.push_back(7);
  const auto lines = health_lines({{"health", {{"causes", causes}}}});
  EXPECT_LE(lines.size(), 130u);
  EXPECT_EQ(lines[0], "a [2J b");
  EXPECT_EQ(lines[1], "  see it again: c rm x");
}

}  // namespace
}  // namespace ls::cli
