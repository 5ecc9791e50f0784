#include <algorithm>
#include <set>

#include "coordinator/http/api/handlers.h"
#include "tests/unit/http/fixture.h"

namespace ls::http::testing {
namespace {

using nlohmann::json;

class Jobs : public ApiTest {};
class Blobs : public ApiTest {};
class Routes : public ApiTest {};

TEST_F(Jobs, XmlSubmissionTakesSettingsFromTheQuery) {
  const Response r =
      ask(Method::post,
          "/api/v1/jobs?spp=64&size=320x200&target_error=1e-3&seed=7&define=a=b%3Dc&tags=fast,big"
          "&float=true&priority=-3&name=bath.xml",
          kSceneText, "Application/XML; charset=utf-8");

  ASSERT_EQ(r.status, 201) << text(r);
  const json body = json_of(r);
  const auto got = records->last_job();
  const std::string url = "/api/v1/jobs/" + got.id.value;
  EXPECT_EQ(body["id"], got.id.value);
  EXPECT_EQ(body["url"], url);
  EXPECT_EQ(body["warnings"].size(), got.warnings.size());
  EXPECT_EQ(header(r, "Location"), url);
  EXPECT_EQ(got.name, "bath.xml");
  EXPECT_EQ(got.spec.spp, 64u);
  EXPECT_EQ(got.spec.size->width, 320);
  EXPECT_EQ(got.spec.size->height, 200);
  EXPECT_EQ(got.spec.target_error, 1e-3);
  EXPECT_EQ(got.spec.seed, 7u);
  EXPECT_EQ(got.spec.defines.at("a"), "b=c");
  EXPECT_EQ(got.spec.tags, (std::vector<std::string>{"fast", "big"}));
  EXPECT_TRUE(got.spec.float_output);
  EXPECT_EQ(got.spec.priority, -3);
}

TEST_F(Jobs, AreSubmittedAsJsonThatNamesBlobs) {
  const Digest scene = blobs->add(with_mesh("a/b.ply"));
  const Digest mesh = blobs->add("mesh");
  const json body{{"scene", scene.hex()},
                  {"assets", {{"a/b.ply", mesh.hex()}}},
                  {"spec", {{"spp", 8}}},
                  {"name", "x.xml"}};

  const Response r = ask(Method::post, "/api/v1/jobs", body.dump());

  ASSERT_EQ(r.status, 201) << text(r);
  const auto got = records->last_job();
  ASSERT_EQ(got.assets.size(), 1u);
  EXPECT_EQ(got.assets[0].name, "a/b.ply");
  EXPECT_EQ(got.assets[0].digest, mesh);
  EXPECT_EQ(got.spec.spp, 8u);
  EXPECT_EQ(got.name, "x.xml");
}

TEST_F(Jobs, SayWhatIsWrongWithTheRequest) {
  const std::string absent(64, 'a');
  const struct {
    std::string target, type, body;
    int status;
    std::string says;
  } kCases[] = {
      {"/api/v1/jobs", "application/json", "{", 400, "not JSON"},
      {"/api/v1/jobs", "application/json", "[]", 400, "object"},
      {"/api/v1/jobs", "application/json", "{}", 400, "'scene'"},
      {"/api/v1/jobs", "application/json", "{\"scen\":1}", 400, "'scen'"},
      {"/api/v1/jobs", "application/json", "{\"scene\":1}", 400, "64 hexadecimal"},
      {"/api/v1/jobs", "application/json", "{\"scene\":\"../../etc/passwd\"}", 400, "64 hexadecimal"},
      {"/api/v1/jobs", "application/json", "{\"scene\":\"" + absent + "\"}", 409,
       "PUT /api/v1/blobs/" + absent},
      {"/api/v1/jobs", "application/json", "{\"scene\":\"" + absent + "\",\"assets\":[]}", 400, "'assets'"},
      {"/api/v1/jobs", "application/json", "{\"scene\":\"" + absent + "\",\"spec\":{\"sp\":4}}", 400, "sp"},
      {"/api/v1/jobs", "application/json",
       "{\"scene\":\"" + absent + "\",\"spec\":" + std::string(1'000'000, '[') + std::string(1'000'000, ']') +
           "}",
       400, "deeper"},
      {"/api/v1/jobs?sp=4", "application/xml", "<scene/>", 400, "'sp'"},
      {"/api/v1/jobs?spp=4&spp=5", "application/xml", "<scene/>", 400, "twice"},
      {"/api/v1/jobs?spp=-4", "application/xml", "<scene/>", 400, "'spp'"},
      {"/api/v1/jobs?size=10", "application/xml", "<scene/>", 400, "WIDTHxHEIGHT"},
      {"/api/v1/jobs?float=maybe", "application/xml", "<scene/>", 400, "'float'"},
      {"/api/v1/jobs?define=x", "application/xml", "<scene/>", 400, "NAME=VALUE"},
      {"/api/v1/jobs", "application/x-7z-compressed", "7z", 415, "application/zip"},
      {"/api/v1/jobs", "application/x-www-form-urlencoded", "x", 415, "application/json"},
  };
  for (const auto& c : kCases) {
    const Response r = ask(Method::post, c.target, c.body, c.type);

    EXPECT_EQ(r.status, c.status) << c.target << ' ' << c.body.substr(0, 200);
    EXPECT_EQ(r.content_type, "application/problem+json");
    const json problem = json_of(r);
    EXPECT_EQ(problem["status"], c.status);
    EXPECT_NE(problem["detail"].get<std::string>().find(c.says), std::string::npos) << problem;
  }
  EXPECT_TRUE(coordinator->jobs().empty());
}

TEST_F(Jobs, ShowTheDiagnosticsOfARefusedScene) {
  const Response r = ask(Method::post, "/api/v1/jobs?name=bath.xml", kMisspeltScene, "text/xml");

  EXPECT_EQ(r.status, 400);
  const json d = json_of(r)["diagnostics"][0];
  EXPECT_EQ(d["severity"], "error");
  EXPECT_EQ(d["file"], "bath.xml");
  EXPECT_EQ(d["line"], 7);
  EXPECT_EQ(d["column"], 37);
  EXPECT_NE(d["text"].get<std::string>().find("radius"), std::string::npos);
}

TEST_F(Jobs, PatchPausesResumesExtendsAndCancels) {
  const std::string url = "/api/v1/jobs/" + submit();

  EXPECT_EQ(json_of(ask(Method::patch, url, R"({"state":"paused","priority":5,"spp":32})"))["state"],
            "paused");
  const json job = json_of(ask(Method::get, url));
  EXPECT_EQ(job["priority"], 5);
  EXPECT_EQ(job["spp"], 32);
  EXPECT_EQ(
      json_of(ask(Method::patch, url, R"({"state":"running"})", "application/merge-patch+json"))["state"],
      "queued");
  EXPECT_EQ(ask(Method::del, url).status, 204);
  EXPECT_EQ(json_of(ask(Method::get, url))["state"], "cancelled");
  EXPECT_EQ(ask(Method::patch, url, R"({"spp":64})").status, 409);
  EXPECT_EQ(ask(Method::del, url).status, 204);
  EXPECT_EQ(ask(Method::get, url).status, 404) << "it had ended, so it was removed";
  EXPECT_EQ(ask(Method::del, url).status, 404);
}

TEST_F(Jobs, PatchAcceptsATargetAndEveryPriorityOfTheCommandLine) {
  const std::string url = "/api/v1/jobs/" + submit("?target_error=1");
  const json job = json_of(ask(Method::patch, url, R"({"target_error":0.25,"priority":-1000000})"));
  EXPECT_EQ(job["target_error"], 0.25);
  EXPECT_EQ(job["priority"], -1'000'000);
}

TEST_F(Jobs, AreNotChangedByAWrongPatch) {
  const std::string url = "/api/v1/jobs/" + submit();
  const std::string before = text(ask(Method::get, url));

  for (const char* body :
       {R"({"state":"done"})", R"({"spp":32,"priority":"high"})", R"({"priority":18446744073709551611})",
        R"({"priority":1000001})", R"({"target_error":0})", R"({"target_error":"small","spp":64})",
        R"({"spp":-1})", R"({"spp":2.5})", R"({"state":null})", R"({"colour":1})", "{}", "null"})
    EXPECT_EQ(ask(Method::patch, url, body).status, 400) << body;
  EXPECT_EQ(text(ask(Method::get, url)), before);
}

TEST_F(Jobs, HaveImagesReportAndFigures) {
  const std::string url = "/api/v1/jobs/" + submit();

  FakeFarm farm(*coordinator, 2);

  EXPECT_EQ(text(ask(Method::get, url + "/image.exr")).substr(0, 4), "\x76\x2f\x31\x01");
  EXPECT_EQ(ask(Method::get, url + "/image.exr").content_type, "image/x-exr");
  EXPECT_EQ(text(ask(Method::get, url + "/image.png?exposure=2")).substr(1, 3), "PNG");
  EXPECT_EQ(ask(Method::get, url + "/image.png?t=123").status, 200);
  for (const char* wrong : {"x", "", "1e9", "nan", "inf", "2x"})
    EXPECT_EQ(ask(Method::get, url + "/image.png?exposure=" + wrong).status, 400) << wrong;
  EXPECT_EQ(ask(Method::get, url + "/image.png?view=sRGB").status, 200);
  EXPECT_EQ(ask(Method::get, url + "/image.png?view=Screen%2FWarm").status, 400);
  EXPECT_EQ(json_of(ask(Method::get, url + "/report"))["size"], json({40, 24}));
  EXPECT_EQ(json_of(ask(Method::get, url + "/tiles"))["tiles"].size(), 2u);
  EXPECT_EQ(text(ask(Method::get, url + "/convergence.csv")).substr(0, 8), "seconds,");
  EXPECT_TRUE(eventually([&] {  // the log is stored in the background
    return text(ask(Method::get, url + "/log")).find("submitted\n") != std::string::npos;
  }));
  EXPECT_EQ(json_of(ask(Method::get, "/api/v1/jobs"))["jobs"].size(), 1u);
  EXPECT_EQ(json_of(ask(Method::get, "/api/v1/workers"))["workers"].size(), 2u);
}

TEST_F(Jobs, UnknownJobIs404OnEveryRoute) {
  for (const auto& route : routes()) {
    if (route.pattern.find("{id}") == std::string_view::npos) continue;
    for (const std::string& id :
         std::vector<std::string>{"j-99", "..", "%2e%2e", "a%20b", std::string(200, 'a')}) {
      std::string target(route.pattern);
      target.replace(target.find("{id}"), 4, id);
      const bool has_body = route.method == Method::patch || route.method == Method::post;
      EXPECT_EQ(ask(route.method, target, has_body ? R"({"spp":4})" : "").status, 404) << target;
    }
  }
}

TEST_F(Blobs, UploadedBlobIsFound) {
  const std::string url = "/api/v1/blobs/" + sha256("grid").hex();
  const Response before = ask(Method::head, url);
  EXPECT_EQ(before.status, 404);
  EXPECT_EQ(header(before, "Upload-Offset"), "0");

  EXPECT_EQ(ask(Method::put, url, "grid", "application/octet-stream").status, 201);
  EXPECT_EQ(ask(Method::put, url, "grid", "application/octet-stream").status, 204);

  const Response after = ask(Method::head, url);
  EXPECT_EQ(after.status, 200);
  EXPECT_EQ(header(after, "Upload-Offset"), "4");
  const json missing = json_of(ask(Method::post, "/api/v1/blobs/missing",
                                   json{{"digests", {sha256("grid").hex(), sha256("other").hex()}}}.dump()));
  EXPECT_EQ(missing["missing"], json::array({sha256("other").hex()}));
}

TEST_F(Blobs, BlobWithAWrongDigestOrTooLargeLeavesNothing) {
  const std::string url = "/api/v1/blobs/" + sha256("grid").hex();

  EXPECT_EQ(ask(Method::put, url, "grit", "application/octet-stream").status, 400);
  EXPECT_EQ(ask(Method::put, "/api/v1/blobs/xyz", "grid", "application/octet-stream").status, 400);
  const std::string large(1001, 'x');
  EXPECT_EQ(
      ask(Method::put, "/api/v1/blobs/" + sha256(large).hex(), large, "application/octet-stream").status,
      413);
  EXPECT_EQ(header(ask(Method::head, url), "Upload-Offset"), "0");
  EXPECT_EQ(blobs->open_uploads, 0);

  // A second PUT does not replace the blob, but a body that differs from the blob is rejected.
  ASSERT_EQ(ask(Method::put, url, "grid", "application/octet-stream").status, 201);
  EXPECT_EQ(ask(Method::put, url, "grit", "application/octet-stream").status, 400);
}

TEST_F(Blobs, MissingRefusesABodyThatIsNotAListOfDigests) {
  for (const char* body :
       {"{}", "[]", R"({"digests":"x"})", R"({"digests":[1]})", R"({"digests":["x"]})", "\xff"})
    EXPECT_EQ(ask(Method::post, "/api/v1/blobs/missing", body).status, 400) << body;
}

TEST_F(Routes, NeedATokenUnlessOpen) {
  const std::set<std::string> open = {"/healthz", "/readyz", "/api/v1/session"};
  for (const auto& route : routes()) {
    Request asked = request(route.method, route.pattern, {{"content-type", "application/json"}});
    const auto admitted = api.admit(asked);
    const auto* refused = std::get_if<Response>(&admitted);
    const bool asks_who = route.method == Method::get && route.pattern == "/api/v1/session";
    const bool is_open = open.count(std::string(route.pattern)) > 0 && !asks_who;
    EXPECT_EQ(refused != nullptr && refused->status == 401, !is_open) << route.pattern;
  }
  EXPECT_EQ(ask(request(Method::get, "/api/v1/nothing")).status, 401);
  EXPECT_EQ(ask(Method::get, "/api/v1/nothing").status, 404);
}

TEST_F(Routes, ReportTheCaller) {
  const Response answer = ask(Method::get, "/api/v1/session");
  EXPECT_EQ(answer.status, 200);
  EXPECT_EQ(json_of(answer),
            (nlohmann::json{{"role", "admin"}, {"user", ""}, {"version", LIGHTSHAFT_VERSION}}));
}

TEST_F(Routes, ListAllowedMethods) {
  const Response wrong = ask(Method::put, "/api/v1/jobs/j-1", "x", "text/plain");
  EXPECT_EQ(wrong.status, 405);
  EXPECT_EQ(header(wrong, "Allow"), "GET, HEAD, PATCH, DELETE, OPTIONS");
  const Response options = ask(request(Method::options, "/api/v1/jobs"));
  EXPECT_EQ(options.status, 204);
  EXPECT_EQ(header(options, "Allow"), "GET, HEAD, POST, OPTIONS");
  EXPECT_EQ(header(options, "Access-Control-Allow-Origin"), "");
}

TEST_F(Routes, RefuseABodyByItsAnnouncedLength) {
  Request r =
      request(Method::patch, "/api/v1/jobs/j-1",
              {{"authorization", std::string("Bearer ") + kToken}, {"content-type", "application/json"}});
  r.content_length = kMaxControlJson + 1;

  const auto admitted = api.admit(r);

  ASSERT_NE(std::get_if<Response>(&admitted), nullptr);
  EXPECT_EQ(std::get<Response>(admitted).status, 413);
}

TEST_F(Routes, OpenAndCloseASession) {
  const Fields json_type{{"content-type", "application/json"}};
  EXPECT_EQ(ask(request(Method::post, "/api/v1/session", json_type, R"({"token":"wrong"})")).status, 401);
  EXPECT_EQ(ask(request(Method::post, "/api/v1/session", json_type, R"({"token":5})")).status, 400);
  Fields foreign = json_type;
  foreign.emplace_back("origin", "http://evil");
  EXPECT_EQ(ask(request(Method::post, "/api/v1/session", foreign, json{{"token", kToken}}.dump())).status,
            403);

  const Response opened =
      ask(request(Method::post, "/api/v1/session", json_type, json{{"token", kToken}}.dump()));
  ASSERT_EQ(opened.status, 204);
  const std::string set = header(opened, "Set-Cookie");
  const std::string cookie = set.substr(0, set.find(';'));
  EXPECT_EQ(ask(request(Method::get, "/api/v1/jobs", {{"cookie", cookie}})).status, 200);

  EXPECT_EQ(ask(request(Method::del, "/api/v1/session", {{"cookie", cookie}})).status, 204);
  EXPECT_EQ(ask(request(Method::get, "/api/v1/jobs", {{"cookie", cookie}})).status, 401);
}

TEST_F(Routes, DrainRefusesUnknownWorkersAndOtherStates) {
  const auto patch = [&](const std::string& worker, const std::string& body) {
    return ask(request(
                   Method::patch, "/api/v1/workers/" + worker,
                   {{"authorization", "Bearer " + std::string(kToken)}, {"content-type", "application/json"}},
                   body))
        .status;
  };

  EXPECT_EQ(patch("w-1", R"({"state": "draining"})"), 404);
  EXPECT_EQ(patch("w-1", R"({"state": "connected"})"), 404);
  EXPECT_EQ(patch("w-1", R"({"state": "restarting"})"), 404);
  EXPECT_EQ(patch("w-1", R"({"state": 1})"), 400);
  EXPECT_EQ(patch("w-1", R"({"state": "lost"})"), 400);
  EXPECT_EQ(patch("w-1", R"({"name": "x"})"), 400);
  EXPECT_EQ(patch("..", R"({"state": "draining"})"), 404);
}

TEST_F(Routes, ServeThePagesByExactNameOnly) {
  const Response page = ask(request(Method::get, "/"));
  EXPECT_EQ(text(page), kPage);
  EXPECT_EQ(page.content_type, "text/html; charset=utf-8");
  const std::string policy = header(page, "Content-Security-Policy");
  EXPECT_NE(policy.find("script-src 'self'"), std::string::npos);
  EXPECT_EQ(policy.find("unsafe"), std::string::npos);
  EXPECT_EQ(ask(request(Method::get, "/js/main.js")).content_type, "text/javascript; charset=utf-8");
  EXPECT_EQ(ask(request(Method::get, "/", {{"if-none-match", header(page, "ETag")}})).status, 304);
  EXPECT_EQ(ask(request(Method::post, "/index.html")).status, 405);
  for (const char* path :
       {"/js", "/js/../index.html", "/../../etc/passwd", "/%2e%2e/etc/passwd", "//etc/passwd"})
    EXPECT_EQ(ask(request(Method::get, path)).status, 404) << path;
}

TEST_F(Routes, ReportHealthAndReadiness) {
  EXPECT_EQ(ask(request(Method::get, "/healthz")).status, 200);
  EXPECT_EQ(ask(request(Method::get, "/readyz")).status, 200);
  const std::string url = "/api/v1/jobs/" + submit();
  records->refuses = true;
  ASSERT_EQ(ask(Method::patch, url, R"({"state":"paused"})").status, 507);
  EXPECT_EQ(ask(request(Method::get, "/healthz")).status, 200);
  const Response r = ask(request(Method::get, "/readyz"));
  EXPECT_EQ(r.status, 503);
  EXPECT_NE(text(r).find("the disk is full"), std::string::npos);
}

TEST_F(Routes, ReportWhetherTheWorkersPortResponds) {
  std::string trouble;
  api.workers_port([&] { return trouble; });
  EXPECT_EQ(ask(request(Method::get, "/readyz")).status, 200);
  trouble = "the workers' port has not answered for 20 s";

  const Response r = ask(request(Method::get, "/readyz"));

  EXPECT_EQ(r.status, 503);
  EXPECT_NE(text(r).find(trouble), std::string::npos) << text(r);
}

TEST_F(Routes, ShowMetrics) {
  submit();
  api.counters().answered(Method::get, 200);

  const std::string metrics = text(ask(Method::get, "/metrics"));

  EXPECT_NE(metrics.find("lightshaft_jobs{state=\"queued\"} 1\n"), std::string::npos) << metrics;
  EXPECT_NE(metrics.find("\nlightshaft_queued_core_seconds 0\n"), std::string::npos) << metrics;
  EXPECT_NE(metrics.find("lightshaft_http_requests_total{method=\"GET\",code=\"200\"} 1\n"),
            std::string::npos);
  EXPECT_NE(metrics.find("# TYPE lightshaft_workers gauge\n"), std::string::npos);
}

TEST_F(Routes, ParseTheLastEventId) {
  const std::string job = submit();
  const auto stream = [&](std::string target, Fields headers = {}) {
    headers.emplace_back("authorization", std::string("Bearer ") + kToken);
    return ask(request(Method::get, target, std::move(headers)));
  };

  EXPECT_FALSE(stream("/api/v1/events").events->after_id);
  EXPECT_EQ(stream("/api/v1/events?last_event_id=3").events->after_id, 3u);
  EXPECT_EQ(stream("/api/v1/events?last_event_id=3", {{"last-event-id", "9"}}).events->after_id, 9u);
  EXPECT_EQ(stream("/api/v1/jobs/" + job + "/events").events->job, job);
  EXPECT_EQ(stream("/api/v1/events?last_event_id=-1").status, 400);
  EXPECT_EQ(stream("/api/v1/jobs/j-99/events").status, 404);
}

TEST_F(Routes, MatchTheOpenApiDocument) {
  const json doc = json::parse(embedded_openapi());
  std::set<std::string> documented, answered;
  for (const auto& path : doc["paths"].items())
    for (const auto& method : path.value().items())
      if (method.key() != "parameters") documented.insert(method.key() + " " + path.key());
  for (const auto& route : routes()) {
    std::string method(to_string(route.method));
    std::transform(method.begin(), method.end(), method.begin(), ::tolower);
    answered.insert(method + " " + std::string(route.pattern));
    const json& operation = doc["paths"][std::string(route.pattern)][method];
    EXPECT_EQ(operation.contains("security"), route.access == Access::open) << route.pattern;
    EXPECT_EQ(operation.contains("requestBody"), route.body != BodyKind::none) << route.pattern;
    if (route.body != BodyKind::buffered) continue;
    for (const auto& type : operation["requestBody"]["content"].items())
      EXPECT_NE((std::string(route.accepts) + " " + std::string(route.unpacks)).find(type.key()),
                std::string::npos)
          << route.pattern << ' ' << type.key();
  }

  EXPECT_EQ(documented, answered);
  EXPECT_EQ(doc["openapi"], "3.1.0");
}

// Every "$ref" in the document names something that exists.
TEST_F(Routes, DocumentHasNoDanglingReference) {
  const json doc = json::parse(embedded_openapi());
  std::vector<const json*> open{&doc};
  int references = 0;
  while (!open.empty()) {
    const json& node = *open.back();
    open.pop_back();
    if (node.is_object() && node.contains("$ref")) {
      ++references;
      EXPECT_TRUE(doc.contains(json::json_pointer(node["$ref"].get<std::string>().substr(1)))) << node;
    }
    if (node.is_structured())
      for (const auto& child : node) open.push_back(&child);
  }
  EXPECT_GT(references, 10);
}

TEST(Problem, MapsEveryErrorCodeToAStatus) {
  EXPECT_EQ(status_of(Errc::invalid_argument), 400);
  EXPECT_EQ(status_of(Errc::unauthenticated), 401);
  EXPECT_EQ(status_of(Errc::permission_denied), 403);
  EXPECT_EQ(status_of(Errc::not_found), 404);
  EXPECT_EQ(status_of(Errc::already_exists), 409);
  EXPECT_EQ(status_of(Errc::failed_precondition), 409);
  EXPECT_EQ(status_of(Errc::internal), 500);
  EXPECT_EQ(status_of(Errc::unavailable), 503);
  EXPECT_EQ(status_of(Errc::resource_exhausted), 507);
}

}  // namespace
}  // namespace ls::http::testing
