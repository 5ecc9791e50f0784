// Fixtures with an Api and a coordinator in memory; ask() sends one request to the Api.
#pragma once

#include <gtest/gtest.h>

#include <chrono>
#include <nlohmann/json.hpp>
#include <thread>

#include "coordinator/http/api/api.h"
#include "coordinator/http/message/message.h"
#include "tests/support/eventually.h"
#include "tests/unit/http/watched_stores.h"
#include "tests/unit/service/fake_farm.h"

namespace ls::http::testing {

using test::eventually;

inline constexpr const char* kToken = "0123456789abcdef0123456789abcdef";

inline constexpr const char* kJoinToken = "join-join-join-join-join";

inline const std::string kMisspeltScene =
    with_shape("<shape type=\"sphere\"><float name=\"radiuss\" value=\"1\"/></shape>");

inline constexpr char kPage[] = "<!doctype html><title>dashboard</title>";
inline const StaticFile kPages[] = {{"index.html", std::as_bytes(std::span(kPage, sizeof kPage - 1))},
                                    {"js/main.js", std::as_bytes(std::span(kPage, 9))}};

inline Request request(Method method, std::string_view target, Fields headers = {}, std::string body = {}) {
  Request r;
  r.method = method;
  auto parsed = parse_target(target);
  EXPECT_TRUE(parsed) << target;
  if (parsed) {
    r.segments = parsed->segments;
    r.query = parsed->query;
  }
  r.headers = std::move(headers);
  if (r.header("host").empty()) r.headers.emplace_back("host", "farm:8080");
  r.has_body = !body.empty();
  r.content_length = body.size();
  r.body = std::move(body);
  return r;
}

// A coordinator in memory, with its store.
class CoordinatorTest : public ::testing::Test {
 protected:
  static std::unique_ptr<Coordinator> open(Coordinator::Options options) {
    auto opened = Coordinator::open(std::move(options));
    EXPECT_TRUE(opened) << opened.error().message;
    return std::move(*opened);
  }
  const std::shared_ptr<WatchedBlobs> blobs = std::make_shared<WatchedBlobs>();
  const std::shared_ptr<WatchedRecords> records = std::make_shared<WatchedRecords>();
  std::unique_ptr<Coordinator> coordinator = open({.jobs = records, .blobs = blobs});
};

class ApiTest : public CoordinatorTest {
 protected:
  // Handles the request as the server loop does: admit(), then the handler or the upload.
  Response ask(Request r) {
    auto admitted = api.admit(r);
    if (auto* response = std::get_if<Response>(&admitted)) return *response;
    auto& match = std::get<Match>(admitted);
    const BodyKind kind = api.body_kind(*match.route, r);
    if (kind != BodyKind::blob && kind != BodyKind::archive) {
      Response answer = api.handle(match, r);
      return api.may_be_another_coordinators(match, answer)
                 ? api.ask_other_coordinator(match, r, std::move(answer))
                 : answer;
    }
    auto opened = api.open_upload(match, r);
    if (auto* response = std::get_if<Response>(&opened)) return *response;
    auto& sink = std::get<std::unique_ptr<BodySink>>(opened);
    if (auto refused = sink->append(std::as_bytes(std::span(r.body)))) return *refused;
    return sink->finish();
  }
  // Sends the request with the administrator's token.
  Response ask(Method method, std::string_view target, std::string body = {},
               std::string type = "application/json") {
    Fields headers{{"authorization", std::string("Bearer ") + kToken}};
    if (!body.empty()) headers.emplace_back("content-type", std::move(type));
    return ask(request(method, target, std::move(headers), std::move(body)));
  }
  std::string submit(const std::string& query = "") {
    const Response r = ask(Method::post, "/api/v1/jobs" + query, kSceneText, "application/xml");
    EXPECT_EQ(r.status, 201);
    return json_of(r)["id"];
  }
  static std::string text(const Response& r) {
    return std::string(reinterpret_cast<const char*>(r.bytes().data()), r.bytes().size());
  }
  static nlohmann::json json_of(const Response& r) { return nlohmann::json::parse(text(r)); }
  static std::string header(const Response& r, std::string_view name) {
    for (const auto& [key, value] : r.headers)
      if (key == name) return value;
    return {};
  }

  Limits limits{.blob_bytes = 1000};
  TokenRegistry tokens{kToken, kJoinToken};
  Api api{*coordinator, tokens, limits, StaticFiles(kPages)};
};

}  // namespace ls::http::testing
