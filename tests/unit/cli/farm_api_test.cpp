#include "cli/farm/farm_api.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "cli/farm/farm_tables.h"

namespace ls::cli {
namespace {

using nlohmann::json;
using testing::HasSubstr;
using testing::Not;

TEST(Problem, KeepsTheDiagnosticsWithTheirPlace) {
  const json body{{"status", 400},
                  {"detail", "the scene a.xml cannot be read"},
                  {"diagnostics",
                   {{{"severity", "error"},
                     {"file", "a.xml"},
                     {"line", 3},
                     {"column", 7},
                     {"text", "no such plugin"},
                     {"source_line", "<bsdf/>"},
                     {"length", 4}}}}};

  const auto problem = problem_of({400, body.dump()});

  EXPECT_EQ(problem.error, (Error{Errc::invalid_argument, "the scene a.xml cannot be read"}));
  ASSERT_EQ(problem.diagnostics.size(), 1u);
  EXPECT_EQ(problem.diagnostics[0],
            (Diagnostic{Diagnostic::Severity::error, {"a.xml", 3, 7}, "no such plugin", "<bsdf/>", 4}));
}

TEST(Addresses, MayLeaveOutTheirScheme) {
  EXPECT_EQ(addresses_in("127.0.0.1:8080", false), std::vector<std::string>{"http://127.0.0.1:8080"});
  EXPECT_EQ(addresses_in("localhost:8080", true), std::vector<std::string>{"https://localhost:8080"});
  EXPECT_EQ(addresses_in("farm:8080", false), std::vector<std::string>{"https://farm:8080"})
      << "no token in clear text across a network unless asked for";
  EXPECT_EQ(addresses_in("https://a/,b:1/", false), (std::vector<std::string>{"https://a", "https://b:1"}));
  EXPECT_FALSE(HttpClient::open({.url = "ftp://farm"}));
}

TEST(Problem, SaysWhereTheTokenIs) {
  const auto problem = problem_of({401, R"({"detail": "the token is wrong"})"});

  EXPECT_EQ(problem.error.code, Errc::unauthenticated);
  EXPECT_THAT(problem.error.message, HasSubstr("LIGHTSHAFT_TOKEN"));
}

TEST(Problem, HandlesAnswersWithoutProblemDetails) {
  EXPECT_THAT(problem_of({502, "<html>Bad gateway" + std::string(5000, '!')}).error.message,
              testing::AllOf(HasSubstr("502"), HasSubstr("Bad gateway")));
  for (const char* body :
       {"", "[]", "{}", R"({"detail": 5, "diagnostics": "x"})", R"({"diagnostics": [1, {"line": "x"}]})"})
    EXPECT_FALSE(problem_of({500, body}).error.message.empty()) << body;
}

TEST(JobPath, EscapesInvalidIds) {
  EXPECT_EQ(job_path("j-12ab"), "/api/v1/jobs/j-12ab");
  EXPECT_EQ(job_path("../x?y"), "/api/v1/jobs/..%2Fx%3Fy");
}

TEST(FarmTables, HandleMissingAndWrongFields) {
  const json jobs = json::parse(
      R"({"jobs": [{}, 5, {"id": 7, "progress": "x"}, {"id": "j-1", "progress": 0.5, "relmse": null}]})");

  EXPECT_THAT(jobs_table(jobs), testing::AllOf(HasSubstr("j-1"), HasSubstr("50 %")));
  EXPECT_EQ(jobs_table(json::object()), "no jobs");
  EXPECT_EQ(workers_table(json::parse(R"({"workers": 3})")), "no workers");
  EXPECT_FALSE(job_text(json::object()).empty());
}

TEST(FarmTables, MarkFakeWorkersAndJobs) {
  const auto tables = [](bool fake) {
    const json worker{{"name", "w"}, {"state", "connected"}, {"fake", fake}};
    const json job{{"id", "j-1"}, {"name", "fog.xml"}, {"fake", fake}};
    return std::vector{workers_table({{"workers", {worker}}}), jobs_table({{"jobs", {job}}}), job_text(job)};
  };

  EXPECT_THAT(tables(true), testing::Each(HasSubstr("fake")));
  EXPECT_THAT(tables(false), testing::Each(Not(HasSubstr("fake"))));
}

TEST(FarmTables, NameTheClassAndItsShareOfTheFarm) {
  const std::string digits(64, 'a');
  const json worker{{"name", "w"}, {"numeric_class", digits}, {"platform", "armv8-a:gcc-14.2.0"}};
  const json share{{"workers", 1}, {"of_workers", 3}, {"threads", 2}, {"of_threads", 8}, {"share", .25}};
  const json job{
      {"id", "j-1"}, {"numeric_class", digits}, {"platform", "armv8-a:gcc-14.2.0"}, {"class_share", share}};

  EXPECT_THAT(workers_table({{"workers", {worker}}}), HasSubstr("aaaaaaaaaaaa armv8-a:gcc-14.2.0"));
  EXPECT_THAT(job_text(job), testing::AllOf(HasSubstr("aaaaaaaaaaaa armv8-a:gcc-14.2.0"),
                                            HasSubstr("25 % of the farm: 1 of 3 workers, 2 of 8 threads")));
  EXPECT_THAT(job_text({{"id", "j-1"}, {"class_share", nullptr}}), Not(HasSubstr("of the farm")));
}

TEST(FarmTables, RemoveTerminalControlsFromNames) {
  const json jobs{{"jobs", {{{"id", "j-1"}, {"name", "a\x1b[2Jb\nc"}}}}};

  EXPECT_THAT(jobs_table(jobs), Not(HasSubstr("\x1b")));
  EXPECT_THAT(jobs_table(jobs), HasSubstr("a [2Jb c"));
}

TEST(HttpClient, RefusesImpossibleAddressesAndTokens) {
  for (const char* url : {"ftp://farm", "file:///etc/passwd", "http://farm/ x", "http://farm\r\nX: y", ""})
    EXPECT_EQ(HttpClient::open({url, "", ""}).error().code, Errc::invalid_argument) << url;
  EXPECT_FALSE(HttpClient::open({"http://farm", "token\r\nX-Evil: 1", ""}));
  EXPECT_FALSE(HttpClient::open({"https://farm", "", "/no/such/file.pem"}));
  EXPECT_TRUE(HttpClient::open({"http://farm:8080/", "abc-DEF_123", ""}));
}

}  // namespace
}  // namespace ls::cli
