// The spans that a worker records below the spans of its leases.
#include "tests/support/span_collector.h"
#include "tests/unit/agent/agent_rig.h"

namespace ls::worker {
namespace {

const auto kLeaseSpan =
    trace::parse_traceparent("00-0af7651916cd43dd8448eb211c80319c-b7ad6b7169203331-01").value();

TEST_F(AgentTest, RecordsWhatItDoesForALeaseBelowTheLeasesSpan) {
  test::SpanCollector collector;
  AgentOptions options;
  options.tracer = collector.tracer();
  start(std::move(options));
  AssignLease lease = assign("l-1", "j-1", tiles_up_to(3));
  lease.trace = kLeaseSpan;
  coordinator_.tell(lease);
  coordinator_.wait_for([](auto& c) { return c.results.size() == 3; });
  ASSERT_TRUE(drain());
  agent_.reset();
  ASSERT_TRUE(collector.wait_for_requests(1));

  const auto load = collector.named("load scene");
  ASSERT_EQ(load.size(), 1u);
  EXPECT_EQ(load[0].parent, hex(kLeaseSpan.span));
  EXPECT_EQ(collector.named("fetch blob").at(0).parent, load[0].id);
  EXPECT_EQ(collector.named("build world").at(0).parent, load[0].id);
  for (const char* name : {"render unit", "encode partial", "send partial"}) {
    const auto spans = collector.named(name);
    EXPECT_EQ(spans.size(), 3u) << name;
    for (const auto& span : spans) {
      EXPECT_EQ(span.trace, hex(kLeaseSpan.trace));
      EXPECT_EQ(span.parent, hex(kLeaseSpan.span));
    }
  }
  for (const UnitResult& result : coordinator_.results) EXPECT_GT(result.held_unix_ns, 0u);
}

TEST_F(AgentTest, RecordsNothingOfALeaseThatIsNotTraced) {
  test::SpanCollector collector;
  AgentOptions options;
  options.tracer = collector.tracer();
  start(std::move(options));
  coordinator_.tell(assign("l-1", "j-1", tiles_up_to(3)));
  coordinator_.wait_for([](auto& c) { return c.results.size() == 3; });
  ASSERT_TRUE(drain());
  agent_.reset();

  EXPECT_TRUE(collector.spans().empty());
  for (const UnitResult& result : coordinator_.results) EXPECT_EQ(result.held_unix_ns, 0u);
}

TEST_F(AgentTest, WithoutATracerItIgnoresTheSpanOfALease) {
  start();
  AssignLease lease = assign("l-1", "j-1", tiles_up_to(3));
  lease.trace = kLeaseSpan;
  coordinator_.tell(lease);
  coordinator_.wait_for([](auto& c) { return c.results.size() == 3; });
  ASSERT_TRUE(drain());

  for (const UnitResult& result : coordinator_.results) EXPECT_EQ(result.held_unix_ns, 0u);
}

}  // namespace
}  // namespace ls::worker
