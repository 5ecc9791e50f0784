// A submit token shows only the jobs, workers and events of its own user. (All routes:
// tests/system/test_authorisation.py.)
#include "coordinator/http/auth/auth.h"
#include "tests/unit/http/fixture.h"

namespace ls::http::testing {
namespace {

using nlohmann::json;

class Ownership : public ApiTest {
 protected:
  Response ask_as(const std::string& token, Method method, std::string_view target, std::string body = {},
                  std::string type = "application/xml") {
    Fields headers{{"authorization", "Bearer " + token}};
    if (!body.empty()) headers.emplace_back("content-type", std::move(type));
    return ask(request(method, target, std::move(headers), std::move(body)));
  }
  std::string submit_as(const std::string& token) {
    const Response r = ask_as(token, Method::post, "/api/v1/jobs", kSceneText);
    EXPECT_EQ(r.status, 201);
    return json_of(r)["id"];
  }
  const std::string anna = tokens.add(Role::submit, "anna").value().token;
  const std::string bert = tokens.add(Role::submit, "bert").value().token;
};

TEST_F(Ownership, JobBelongsToTheTokensUser) {
  submit_as(anna);
  EXPECT_EQ(records->last_job().owner, "anna");
  submit();
  EXPECT_EQ(records->last_job().owner, "");
}

TEST_F(Ownership, ListHasOnlyTheCallersJobs) {
  submit_as(anna);
  EXPECT_EQ(json_of(ask_as(anna, Method::get, "/api/v1/jobs"))["jobs"].size(), 1u);
  EXPECT_EQ(json_of(ask_as(bert, Method::get, "/api/v1/jobs"))["jobs"].size(), 0u);
}

TEST_F(Ownership, ReadTokenCannotSubmit) {
  const std::string reader = tokens.add(Role::read, "").value().token;
  EXPECT_EQ(ask_as(reader, Method::post, "/api/v1/jobs", kSceneText).status, 403);
}

TEST_F(Ownership, RequestForAnotherCoordinatorsJobIsRedirectedForEveryCaller) {
  records->others["j-away"] = {.http = "http://other:8080", .alive = true};
  for (const std::string& token : {anna, bert, std::string(kToken)}) {
    const Response moved = ask_as(token, Method::get, "/api/v1/jobs/j-away");
    EXPECT_EQ(moved.status, 307);
    EXPECT_EQ(header(moved, "Location"), "http://other:8080/api/v1/jobs/j-away");
  }
}

TEST_F(Ownership, LocalJobOfAnotherUserLooksMissingWhateverOtherCoordinatorsHave) {
  const std::string id = submit_as(anna);
  records->others[id] = {.http = "http://other:8080", .alive = true};
  const Response none = ask_as(bert, Method::get, "/api/v1/jobs/j-none");
  const Response annas = ask_as(bert, Method::get, "/api/v1/jobs/" + id);
  EXPECT_EQ(annas.status, 404);
  EXPECT_EQ(json_of(annas), json_of(none));
}

TEST(Visible, HidesEventsOfOtherUsersAndSecretsOfWorkers) {
  const Caller anna{Role::submit, "anna", "a"}, reader{Role::read, "", "r"};
  const coordinator::StreamEvent job{1, "job", "{}", "j-1", "bert"}, old{2, "tile", "{}", "j-0", ""};
  EXPECT_FALSE(visible(job, anna));
  EXPECT_FALSE(visible(old, anna));
  EXPECT_TRUE(visible(job, reader));

  const coordinator::StreamEvent worker{3, "worker", R"({"job":"j-1","activity":"j-1 tile 4","name":"w"})",
                                        "", "bert"};
  const auto hidden = visible(worker, anna);
  ASSERT_TRUE(hidden);
  EXPECT_EQ(json::parse(hidden->data), json::parse(R"({"job":null,"activity":"","name":"w"})"));
  EXPECT_EQ(visible(worker, {Role::submit, "bert", "b"})->data, worker.data);
  EXPECT_EQ(visible(worker, reader)->data, worker.data);
}

TEST_F(Ownership, UsersCannotExceedTheUserPriority) {
  const Response refused = ask_as(anna, Method::post, "/api/v1/jobs?priority=1", kSceneText);
  EXPECT_EQ(refused.status, 403);
  EXPECT_NE(text(refused).find("--user-priority"), std::string::npos);
  EXPECT_EQ(ask_as(kToken, Method::post, "/api/v1/jobs?priority=1000000", kSceneText).status, 201);

  const std::string id = submit_as(anna);
  const auto patch = [&](const std::string& token, int priority) {
    return ask_as(token, Method::patch, "/api/v1/jobs/" + id,
                  "{\"priority\":" + std::to_string(priority) + "}", "application/json")
        .status;
  };
  EXPECT_EQ(patch(anna, 1), 403);
  EXPECT_EQ(coordinator->job({id})->priority, 0);
  EXPECT_EQ(patch(anna, -5), 200);
  EXPECT_EQ(patch(kToken, 7), 200);
}

TEST(Visible, WorkerEventWithoutAJobHidesOtherUsersJobs) {
  const coordinator::StreamEvent quarantined{
      3, "worker", R"({"job":null,"activity":"quarantined: it rendered tile 3 of job j-1"})", "", ""};
  const auto hidden = visible(quarantined, {Role::submit, "anna", "a"});
  ASSERT_TRUE(hidden);
  EXPECT_EQ(json::parse(hidden->data)["activity"], "");
  EXPECT_EQ(visible(quarantined, {Role::read, "", "r"})->data, quarantined.data);
}

TEST(Visible, CallerWithoutARoleSeesNothing) {
  const Caller nobody;
  EXPECT_FALSE(nobody.sees(""));
  EXPECT_FALSE(nobody.sees("anna"));
  for (const Route& route : routes())
    if (route.access != Access::open) EXPECT_FALSE(allows(route.access, nobody.role)) << route.pattern;
}

}  // namespace
}  // namespace ls::http::testing
