// Jobs that wait for others, over HTTP: in the query and in JSON, what is shown of them, and how that is
// changed.
#include "tests/unit/http/fixture.h"

namespace ls::http::testing {
namespace {

using WaitingTest = ApiTest;

TEST_F(WaitingTest, IsReadFromQueryAndJson) {
  const std::string first = submit(), second = submit("?after=" + first);
  const auto shown = json_of(ask(Method::get, "/api/v1/jobs/" + second));
  EXPECT_EQ(shown["after"], nlohmann::json::parse(R"([{"id": ")" + first + R"(", "state": "queued"}])"));
  EXPECT_EQ(shown["waits_for"], "waits for job " + first + ", which is queued");
  EXPECT_EQ(shown["state"], "queued");

  const std::string scene = blobs->add(kSceneText).hex();
  const auto third =
      ask(Method::post, "/api/v1/jobs",
          R"({"scene": ")" + scene + R"(", "spec": {"after": [")" + first + R"(", ")" + second + R"("]}})");

  ASSERT_EQ(third.status, 201);
  EXPECT_EQ(records->last_job().spec.after, (std::vector{first, second}));
}

TEST_F(WaitingTest, EmptyWaitIsStored) {
  const auto shown = json_of(ask(Method::get, "/api/v1/jobs/" + submit()));
  EXPECT_EQ(shown["after"], nlohmann::json::array());
  EXPECT_TRUE(shown["waits_for"].is_null());
}

TEST_F(WaitingTest, WaitForAnUnknownJobIsRefused) {
  const auto refused = ask(Method::post, "/api/v1/jobs?after=j-none", kSceneText, "application/xml");
  EXPECT_EQ(refused.status, 400);
  EXPECT_EQ(json_of(refused)["detail"], "after: there is no job j-none");
}

TEST_F(WaitingTest, MayBeChangedButNotToACycle) {
  const std::string first = submit(), second = submit("?after=" + first);
  const auto change = [&](const std::string& job, const std::string& after) {
    return ask(Method::patch, "/api/v1/jobs/" + job, R"({"after": )" + after + "}");
  };

  EXPECT_EQ(change(first, R"([")" + second + R"("])").status, 400);
  EXPECT_EQ(change(first, R"("j-1")").status, 400) << "it is no list";
  EXPECT_EQ(change(second, "[]").status, 200);
  EXPECT_EQ(json_of(ask(Method::get, "/api/v1/jobs/" + second))["after"], nlohmann::json::array());
  EXPECT_EQ(change(first, R"([")" + second + R"("])").status, 200);
}

}  // namespace
}  // namespace ls::http::testing
