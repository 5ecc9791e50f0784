// The list of jobs in pages, and submitting a job's scene once more.
#include "tests/unit/http/fixture.h"

namespace ls::http::testing {
namespace {

using nlohmann::json;

class List : public ApiTest {
 protected:
  List() {
    for (const char* name : {"bath.xml", "Cloud.xml", "bathroom.xml"})
      ids.push_back(submit("?name=" + std::string(name)));
    EXPECT_EQ(ask(Method::patch, "/api/v1/jobs/" + ids[1], R"({"state": "cancelled"})").status, 200);
  }
  json list(const std::string& query) { return json_of(ask(Method::get, "/api/v1/jobs?" + query)); }
  std::vector<std::string> names(const std::string& query) {
    std::vector<std::string> out;
    const json page = list(query);
    for (const auto& job : page["jobs"]) out.push_back(job["name"]);
    return out;
  }
  using Names = std::vector<std::string>;
  std::vector<std::string> ids;
};

TEST_F(List, WithoutParametersListsAllJobsInOrder) {
  EXPECT_EQ(names(""), (Names{"bath.xml", "Cloud.xml", "bathroom.xml"}));
  EXPECT_EQ(list("")["total"], 3);
  EXPECT_EQ(list("")["states"]["cancelled"], 1);
  EXPECT_EQ(list("")["owners"], json({""}));
}

TEST_F(List, IsChosenByStateNameIdOwnerAndTime) {
  EXPECT_EQ(names("state=queued,running"), (Names{"bath.xml", "bathroom.xml"}));
  EXPECT_EQ(names("search=BATH&state=queued"), (Names{"bath.xml", "bathroom.xml"}));
  EXPECT_EQ(names("search=" + ids[1]), Names{"Cloud.xml"});
  EXPECT_EQ(names("search=xml%20%20bath%20ROOM"), Names{"bathroom.xml"}) << "all words, in any order";
  EXPECT_EQ(names("search=bath%20cloud"), Names{});
  EXPECT_EQ(names("search=%20").size(), 3u);
  EXPECT_EQ(names("owner=").size(), 3u);
  EXPECT_EQ(names("owner=anna"), Names{});
  EXPECT_EQ(names("since=99999999999"), Names{});
  EXPECT_EQ(list("state=done")["states"]["queued"], 2) << "whatever is asked for";
}

TEST_F(List, IsOrderedAndCutIntoPages) {
  EXPECT_EQ(names("sort=name"), (Names{"bath.xml", "bathroom.xml", "Cloud.xml"}));
  EXPECT_EQ(names("sort=-name"), (Names{"Cloud.xml", "bathroom.xml", "bath.xml"}));
  EXPECT_EQ(names("sort=active").back(), "Cloud.xml") << "it has ended";
  EXPECT_EQ(names("sort=name&offset=1&limit=1"), Names{"bathroom.xml"});
  EXPECT_EQ(list("sort=name&offset=1&limit=1")["total"], 3);
  EXPECT_EQ(names("offset=99&limit=1"), Names{});
  EXPECT_EQ(names("sort=relmse").size(), 3u);
  EXPECT_EQ(names("sort=-progress").size(), 3u);
}

TEST_F(List, InvalidParametersAreRefused) {
  for (const char* wrong : {"state=x", "state=done,,x", "sort=size", "limit=1001", "limit=-1", "offset=x",
                            "since=nan", "since=-1", "limit="})
    EXPECT_EQ(ask(Method::get, std::string("/api/v1/jobs?") + wrong).status, 400) << wrong;
  EXPECT_EQ(ask(Method::get, "/api/v1/jobs?search=" + std::string(201, 'x')).status, 400);
}

TEST_F(List, ResubmittedSceneAcceptsOtherSamples) {
  const Response r = ask(Method::post, "/api/v1/jobs/" + ids[1] + "/again", R"({"spp": 64, "seed": 5})");

  ASSERT_EQ(r.status, 201) << text(r);
  const auto got = records->last_job();
  const json job = json_of(ask(Method::get, json_of(r)["url"].get<std::string>()));
  EXPECT_EQ(job["state"], "queued");
  EXPECT_EQ(job["spp"], 64);
  EXPECT_EQ(job["name"], "Cloud.xml");
  EXPECT_EQ(got.settings.seed, 5u);
  EXPECT_NE(got.id.value, ids[1]);
  FakeFarm farm(*coordinator, 1);
  EXPECT_TRUE(farm.finish(got.id));
}

TEST_F(List, ResubmittedSceneKeepsItsSamplesUnlessOthersAreGiven) {
  const std::string url = "/api/v1/jobs/" + submit("?spp=32&target_error=0.5");

  ASSERT_EQ(ask(Method::post, url + "/again", "{}").status, 201);
  const auto same = records->last_job();
  ASSERT_EQ(ask(Method::post, url + "/again", R"({"time": 3})").status, 201);
  const auto other = records->last_job();

  EXPECT_EQ(same.spp, 32u);
  EXPECT_EQ(same.spec.target_error, 0.5);
  EXPECT_EQ(other.spp, std::nullopt);
  EXPECT_EQ(other.spec.target_error, std::nullopt);
  EXPECT_EQ(other.spec.time, 3);
  for (const char* wrong : {R"({"spp": 0})", R"({"size": "10x10"})", "[]", R"({"time": "long"})"})
    EXPECT_EQ(ask(Method::post, url + "/again", wrong).status, 400) << wrong;
}

TEST_F(List, ResubmittedSceneMayHaveOtherMemory) {
  const std::string url = "/api/v1/jobs/" + submit("?spp=32&memory=1000");

  ASSERT_EQ(ask(Method::post, url + "/again", "{}").status, 201);
  EXPECT_EQ(records->last_job().spec.memory, 1000u);
  ASSERT_EQ(ask(Method::post, url + "/again", R"({"memory": 2000})").status, 201);
  EXPECT_EQ(records->last_job().spec.memory, 2000u);
}

TEST_F(List, PreviewIsAvailableAtAnyTime) {
  const std::string url = "/api/v1/jobs/" + ids[0] + "/thumbnail.png";
  const Response before = ask(Method::get, url);
  FakeFarm farm(*coordinator, 1);
  ASSERT_TRUE(farm.finish({ids[0]}));

  const Response after = ask(Method::get, url);

  EXPECT_EQ(text(before).substr(1, 3), "PNG");
  EXPECT_EQ(text(after).substr(1, 3), "PNG");
  EXPECT_NE(text(before), text(after));
}

}  // namespace
}  // namespace ls::http::testing
