#include "util/trace/span.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "util/trace/otlp.h"

namespace ls::trace {
namespace {

constexpr const char* kText = "00-0af7651916cd43dd8448eb211c80319c-b7ad6b7169203331-01";

TEST(Traceparent, RoundTrips) {
  const auto context = parse_traceparent(kText);

  ASSERT_TRUE(context);
  EXPECT_EQ(hex(context->trace), "0af7651916cd43dd8448eb211c80319c");
  EXPECT_EQ(hex(context->span), "b7ad6b7169203331");
  EXPECT_TRUE(context->sampled);
  EXPECT_EQ(to_traceparent(*context), kText);
}

TEST(Traceparent, SaysWhetherTheTraceIsRecorded) {
  std::string text = kText;
  text.back() = '2';

  EXPECT_FALSE(parse_traceparent(text)->sampled);
  EXPECT_TRUE(to_traceparent(*parse_traceparent(text)).ends_with("-00"));
}

TEST(Traceparent, LaterVersionIsReadAsFarAsPossible) {
  EXPECT_TRUE(parse_traceparent("cc" + std::string(kText).substr(2) + "-what-comes"));
  EXPECT_FALSE(parse_traceparent("cc" + std::string(kText).substr(2) + ".what-comes"));
}

TEST(Traceparent, IsIgnoredIfMalformed) {
  const std::string good = kText;
  const auto changed = [&](std::size_t at, const std::string& part) {
    std::string text = good;
    return text.replace(at, part.size(), part);
  };
  for (const std::string& text :
       {std::string(), std::string("00"), good.substr(0, 54), good + "0", good + "-00", changed(0, "ff"),
        changed(2, "_"), changed(3, std::string(32, '0')), changed(36, std::string(16, '0')), changed(3, "A"),
        changed(52, "+"), changed(53, "x"), std::string(55, '\0'), std::string(1 << 20, '-')})
    EXPECT_FALSE(parse_traceparent(text)) << text.substr(0, 60);
}

TEST(Ids, AreTheSameForTheSameTextOnly) {
  EXPECT_EQ(trace_id_of("job j-1"), trace_id_of("job j-1"));
  EXPECT_NE(trace_id_of("job j-1"), trace_id_of("job j-2"));
  const TraceId trace = trace_id_of("job j-1");
  EXPECT_EQ(span_id_of(trace, "lease l1-1"), span_id_of(trace, "lease l1-1"));
  EXPECT_NE(span_id_of(trace, "lease l1-1"), span_id_of(trace_id_of("job j-2"), "lease l1-1"));
}

using nlohmann::json;

TEST(Otlp, WritesSpansByTheSpecification) {
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

TEST(Otlp, UnknownAnswerCountsAsSuccess) {
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
