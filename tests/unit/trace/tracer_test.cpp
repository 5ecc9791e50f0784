#include "util/trace/tracer.h"

#include <gtest/gtest.h>

#include <map>
#include <set>

#include "tests/support/eventually.h"
#include "tests/support/span_collector.h"

namespace ls::trace {
namespace {

Span a_span(Tracer& tracer) { return {.context = {trace_id_of("t"), tracer.new_span_id()}, .name = "x"}; }

TEST(Tracer, SendsPendingSpansAtTheEnd) {
  test::SpanCollector collector;
  {
    const auto tracer = collector.tracer(std::make_shared<FakeClock>());
    for (int i = 0; i < 3; ++i) tracer->record(a_span(*tracer));
  }

  EXPECT_EQ(collector.spans().size(), 3u);
  const HttpPost& request = collector.requests.at(0);
  EXPECT_EQ(request.url, "http://collector/v1/traces");
  using Header = std::pair<std::string, std::string>;
  const std::set<Header> headers(request.headers.begin(), request.headers.end());
  EXPECT_TRUE(headers.contains(Header{"Content-Type", "application/json"}));
  EXPECT_TRUE(headers.contains(Header{"api-key", "k"}));
  EXPECT_NE(request.body.find(R"("service.instance.id","value":{"stringValue":"one"})"), std::string::npos);
}

TEST(Tracer, NamesEveryAttributeOfTheProgramOnce) {
  std::string body;
  {
    Tracer tracer({.settings = {.url = "http://c",
                                .service = "s",
                                .resource = {{"service.version", "9"},
                                             {"service.instance.id", "other"},
                                             {"team", "light"},
                                             {"team", "shaft"}}},
                   .version = "1",
                   .instance = "one",
                   .clock = std::make_shared<FakeClock>(),
                   .unix_ns = [] { return test::SpanCollector::kUnixNs; },
                   .send = [&](const HttpPost& request) -> Result<HttpAnswer> {
                     body = request.body;
                     return HttpAnswer{200, "{}"};
                   }});
    tracer.record(a_span(tracer));
  }
  std::map<std::string, std::string> attributes;
  const auto request = nlohmann::json::parse(body);
  for (const auto& one : request["resourceSpans"][0]["resource"]["attributes"])
    EXPECT_TRUE(
        attributes.emplace(one["key"].get<std::string>(), one["value"].front().get<std::string>()).second)
        << one["key"];
  EXPECT_EQ(attributes["service.version"], "1");
  EXPECT_EQ(attributes["service.instance.id"], "one");
  EXPECT_EQ(attributes["team"], "light");
}

TEST(Tracer, SpanIdsAreUnique) {
  test::SpanCollector collector;
  const auto tracer = collector.tracer();
  std::set<SpanId> ids;
  for (int i = 0; i < 1000; ++i) ids.insert(tracer->new_span_id());
  EXPECT_EQ(ids.size(), 1000u);
  EXPECT_FALSE(ids.contains(SpanId{}));
}

TEST(Tracer, UsesWallClockTimes) {
  test::SpanCollector collector;
  const auto clock = std::make_shared<FakeClock>();
  const auto tracer = collector.tracer(clock);
  EXPECT_EQ(tracer->unix_ns(clock->now() + std::chrono::seconds(2)),
            test::SpanCollector::kUnixNs + 2'000'000'000);
}

TEST(Tracer, DoesNotWaitForACollectorThatHangs) {
  std::atomic<bool> hangs{true}, asked{false};
  {
    Tracer tracer({.settings = {.url = "http://c", .service = "s"},
                   .clock = std::make_shared<SystemClock>(),
                   .unix_ns = &system_unix_ns,
                   .send = [&](const HttpPost& request) -> Result<HttpAnswer> {
                     asked = true;
                     while (hangs && !request.give_up()) std::this_thread::yield();
                     return fail(Errc::unavailable, "it hangs");
                   }});
    for (std::size_t i = 0; i < kMaxBatch; ++i) tracer.record(a_span(tracer));
    ASSERT_TRUE(test::eventually([&] { return asked.load(); }));

    for (std::size_t i = 0; i < kMaxWaiting + 7; ++i) tracer.record(a_span(tracer));

    EXPECT_EQ(tracer.figures().left_out, 7u) << "what finds no room is counted, and nobody waits";
  }  // the destructor ends although the collector still hangs
  SUCCEED();
}

TEST(Tracer, CountsRefusedSpans) {
  for (const Result<HttpAnswer>& answer :
       {Result<HttpAnswer>(HttpAnswer{400, "no"}), Result<HttpAnswer>(HttpAnswer{302, ""}),
        Result<HttpAnswer>(HttpAnswer{200, R"({"partialSuccess":{"rejectedSpans":"512"}})"})}) {
    test::SpanCollector collector;
    collector.answer = answer;
    const auto tracer = collector.tracer();
    for (std::size_t i = 0; i < kMaxBatch; ++i) tracer->record(a_span(*tracer));

    EXPECT_TRUE(test::eventually([&] { return tracer->figures().refused == kMaxBatch; })) << answer->status;
    EXPECT_EQ(tracer->figures().sent, 0u);
  }
}

}  // namespace
}  // namespace ls::trace
