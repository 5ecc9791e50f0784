#include "common/trace/otlp.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

namespace ls::trace {
namespace {

using nlohmann::json;

TEST(Otlp, WritesASpanAsTheSpecificationSays) {
  const TraceId trace = parse_traceparent("00-0af7651916cd43dd8448eb211c80319c-b7ad6b7169203331-01")->trace;
  const Span span{.context = {trace, SpanId{{1, 2, 3, 4, 5, 6, 7, 8}}},
                  .parent = SpanId{{255}},
                  .name = "lease",
                  .kind = SpanKind::client,
                  .start_ns = 1'700'000'000'123'456'789,
                  .end_ns = 1'700'000'000'123'456'790,
                  .attributes = {{"t", std::string("x")}, {"i", std::int64_t{-3}}, {"d", .5}, {"b", true}},
                  .events = {{5, "running"}},
                  .events_left_out = 2,
                  .failed = true};

  const json body = json::parse(otlp_request({{{"service.name", "farm"}}}, {&span, 1}));

  EXPECT_EQ(body, json::parse(R"({"resourceSpans": [{
    "resource": {"attributes": [{"key": "service.name", "value": {"stringValue": "farm"}}]},
    "scopeSpans": [{"scope": {"name": "lightshaft"}, "spans": [{
      "traceId": "0af7651916cd43dd8448eb211c80319c", "spanId": "0102030405060708",
      "parentSpanId": "ff00000000000000", "name": "lease", "kind": 3,
      "startTimeUnixNano": "1700000000123456789", "endTimeUnixNano": "1700000000123456790",
      "attributes": [{"key": "t", "value": {"stringValue": "x"}}, {"key": "i", "value": {"intValue": "-3"}},
                     {"key": "d", "value": {"doubleValue": 0.5}}, {"key": "b", "value": {"boolValue": true}}],
      "events": [{"timeUnixNano": "5", "name": "running"}], "droppedEventsCount": 2,
      "status": {"code": 2}}]}]}]})"));
}

TEST(Otlp, WritesTextsThatAreNotUtf8) {
  const Span span{.name = "x", .attributes = {{"worker", std::string("\xff\xfe")}}};
  EXPECT_TRUE(json::accept(otlp_request({}, {&span, 1})));
}

TEST(Otlp, ReadsHowManySpansWereRejected) {
  const auto partial =
      otlp_partial_success(R"({"partialSuccess": {"rejectedSpans": "3", "errorMessage": "too\nold"}})");
  EXPECT_EQ(partial.rejected, 3u);
  EXPECT_EQ(partial.message, "too old");
  EXPECT_EQ(otlp_partial_success(R"({"partialSuccess": {"rejectedSpans": 4}})").rejected, 4u);
}

TEST(Otlp, TakesAnAnswerThatItDoesNotUnderstandAsSuccess) {
  for (const std::string& answer :
       {std::string(), std::string("{}"), std::string("<html>"), std::string("[1]"),
        std::string("\xff\x00\x01", 3), std::string(R"({"partialSuccess": 7})"),
        std::string(R"({"partialSuccess": {"rejectedSpans": -1}})"),
        std::string(R"({"partialSuccess": {"rejectedSpans": {}, "errorMessage": []}})"),
        std::string(100'000, '[')})
    EXPECT_EQ(otlp_partial_success(answer).rejected, 0u) << answer.substr(0, 50);
}

}  // namespace
}  // namespace ls::trace
