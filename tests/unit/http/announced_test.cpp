// Announced jobs, which wait for files on their users' machines: how long they are remembered, how many, and
// who sees them.
#include <gmock/gmock.h>

#include "coordinator/http/api/announced_jobs.h"
#include "tests/unit/http/fixture.h"

namespace ls::http::testing {
namespace {

using namespace std::chrono_literals;
using ::testing::ElementsAre;

AnnouncedJob job_of(std::string owner, double since = 0) {
  AnnouncedJob job;
  job.name = "shot.xml", job.files = {"smoke.vdb"}, job.count = 1;
  job.owner = std::move(owner), job.since_unix = since;
  return job;
}

std::vector<std::string> ids(AnnouncedJobs& jobs, TimePoint now) {
  std::vector<std::string> all;
  for (const auto& [id, job] : jobs.list(now)) all.push_back(id);
  return all;
}

TEST(AnnouncedJobs, AreForgottenUnlessTheyAreRepeated) {
  AnnouncedJobs jobs;
  const TimePoint start{};
  ASSERT_TRUE(jobs.announce("b", job_of("ada", 1), start));
  ASSERT_TRUE(jobs.announce("a", job_of("ada", 2), start + 30s));
  EXPECT_THAT(ids(jobs, start + 59s), ElementsAre("b", "a")) << "the oldest is first";
  ASSERT_TRUE(jobs.announce("b", job_of("ada", 59), start + 59s));

  EXPECT_THAT(ids(jobs, start + 90s), ElementsAre("b"));
  EXPECT_EQ(jobs.list(start + 90s)[0].second.since_unix, 1) << "a repetition is not a new announcement";
  EXPECT_THAT(ids(jobs, start + 119s), ElementsAre());
}

TEST(AnnouncedJobs, BelongToTheirUsers) {
  AnnouncedJobs jobs;
  const TimePoint now{};
  ASSERT_TRUE(jobs.announce("a", job_of("ada"), now));

  EXPECT_EQ(jobs.announce("a", job_of("bob"), now).error().code, Errc::already_exists);
  EXPECT_FALSE(jobs.withdraw("a", "bob"));
  EXPECT_THAT(ids(jobs, now), ElementsAre("a"));
  EXPECT_TRUE(jobs.withdraw("a", "ada"));
  EXPECT_THAT(ids(jobs, now), ElementsAre());
}

TEST(AnnouncedJobs, OfOneUserLeaveRoomForOthers) {
  AnnouncedJobs jobs;
  const TimePoint now{};
  for (std::size_t i = 0; i < AnnouncedJobs::kMostEach; ++i)
    ASSERT_TRUE(jobs.announce(std::to_string(i), job_of("ada"), now));

  EXPECT_EQ(jobs.announce("more", job_of("ada"), now).error().code, Errc::resource_exhausted);
  EXPECT_TRUE(jobs.announce("7", job_of("ada"), now)) << "repeating needs no room";
  EXPECT_TRUE(jobs.announce("more", job_of("bob"), now));
  EXPECT_TRUE(jobs.announce("late", job_of("ada"), now + AnnouncedJobs::kLife)) << "the others are forgotten";
}

using AnnouncedTest = ApiTest;

constexpr const char* kBody =
    R"({"name": "shot.xml", "machine": "render-3", "frames": "1-4", "files": ["a", "b", "c", "d", "e", "f"], "count": 9})";

TEST_F(AnnouncedTest, AreListedUntilTheyAreWithdrawn) {
  ASSERT_EQ(ask(Method::put, "/api/v1/announced/x1", kBody).status, 204);

  const auto shown = json_of(ask(Method::get, "/api/v1/announced"))["announced"];
  ASSERT_EQ(shown.size(), 1u);
  EXPECT_EQ(shown[0]["id"], "x1");
  EXPECT_EQ(shown[0]["machine"], "render-3");
  EXPECT_EQ(shown[0]["frames"], "1-4");
  EXPECT_EQ(shown[0]["files"], nlohmann::json({"a", "b", "c", "d", "e"}));
  EXPECT_EQ(shown[0]["count"], 9);

  EXPECT_EQ(ask(Method::del, "/api/v1/announced/x1").status, 204);
  EXPECT_EQ(json_of(ask(Method::get, "/api/v1/announced"))["announced"], nlohmann::json::array());
  EXPECT_EQ(ask(Method::del, "/api/v1/announced/x1").status, 404);
}

TEST_F(AnnouncedTest, WrongOnesAreRefused) {
  for (const char* body :
       {R"({})", R"([])", R"({"name": "s"})", R"({"name": "s", "files": []})",
        R"({"name": "s", "files": [1]})", R"({"name": 1, "files": ["a"]})",
        R"({"name": "s", "files": ["a"], "count": 0})", R"({"name": "s", "files": ["a"], "count": -1})",
        R"({"name": "s", "files": ["a"], "frames": "9-1"})", R"({"name": "s", "files": ["a"], "what": 1})"})
    EXPECT_EQ(ask(Method::put, "/api/v1/announced/x1", body).status, 400) << body;
  EXPECT_EQ(ask(Method::put, "/api/v1/announced/a.b", kBody).status, 400);
  EXPECT_EQ(json_of(ask(Method::get, "/api/v1/announced"))["announced"].size(), 0u);
}

}  // namespace
}  // namespace ls::http::testing
