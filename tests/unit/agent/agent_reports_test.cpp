// What an agent reports besides results: the times of loading, idling and waiting, and trace spans.
#include <gmock/gmock.h>

#include <numeric>

#include "tests/support/span_collector.h"
#include "tests/unit/agent/agent_rig.h"
#include "worker/agent/gap_meter.h"

namespace ls::worker {
namespace {

// The fake renderer on a clock that advances only when it prepares a job (by 2 s) and when it renders a unit:
// by 3/4 s, of which it reports 1/2 s as rendering, with 1/8 s of CPU time; the other 1/4 s counts as idle.
class TimedBackend final : public RenderBackend {
 public:
  TimedBackend(std::unique_ptr<RenderBackend> fake, FakeClock& clock)
      : fake_(std::move(fake)), clock_(clock) {}
  Digest numeric_class() const override { return fake_->numeric_class(); }
  tl::expected<void, UnitFailure> prepare(const LocalJob& job, const std::atomic<bool>& stop) override {
    clock_.advance(std::chrono::seconds(2));
    return fake_->prepare(job, stop);
  }
  tl::expected<RenderedUnit, UnitFailure> render(const LocalJob& job, const LeaseUnit& unit,
                                                 const std::atomic<bool>& stop) override {
    auto rendered = fake_->render(job, unit, stop);
    clock_.advance(std::chrono::milliseconds(750));
    if (rendered) rendered->wall_seconds = .5, rendered->cpu_seconds = .125;
    return rendered;
  }
  void forget(const JobId& job) override { fake_->forget(job); }
  std::uint64_t rss_bytes() const override { return 0; }

 private:
  std::unique_ptr<RenderBackend> fake_;
  FakeClock& clock_;
};

TEST_F(AgentTest, ReportsLoadTimeOnceAndTheIdleTimeOfItsThreads) {
  start_with(std::make_unique<TimedBackend>(make_fake_backend({}), clock_));
  coordinator_.tell(assign("l-1", "j-1", tiles_up_to(5)));
  coordinator_.wait_for([](auto& c) { return c.results.size() == 5; });
  ASSERT_TRUE(drain());

  for (std::size_t i = 0; i < 5; ++i) {
    const UnitTimes& times = coordinator_.results[i].times;
    EXPECT_DOUBLE_EQ(times.build, i == 0 ? 2 : 0);
    EXPECT_DOUBLE_EQ(times.idle, i == 0 ? 0 : .25) << "before the first unit it waits for the world";
    EXPECT_DOUBLE_EQ(times.wait, .375);
    EXPECT_DOUBLE_EQ(times.load, 0);
    EXPECT_DOUBLE_EQ(times.transfer, 0) << "this clock stands still meanwhile";
  }
}

TEST(GapMeter, IsEmptyWithoutGaps) {
  const GapMeter gaps;
  EXPECT_EQ(gaps.count(), 0u);
  EXPECT_EQ(gaps.quantile(.5), 0);
}

TEST(GapMeter, QuantilesAreAccurateToOneStep) {
  GapMeter gaps;
  for (int i = 1; i <= 1000; ++i) gaps.add(i * 1e-5);  // 10 us to 10 ms
  EXPECT_EQ(gaps.count(), 1000u);
  EXPECT_THAT(gaps.text(), testing::HasSubstr("longest 10.00 ms"));
  // quantile() returns the upper end of the bucket that contains the quantile, so it is never too small, and
  // too large by a factor of at most 2^(1/8).
  for (const double q : {.01, .5, .99}) {
    EXPECT_GE(gaps.quantile(q), q * 1e-2 * (1 - 1e-12)) << q;
    EXPECT_LE(gaps.quantile(q), q * 1e-2 * 1.0906) << q;
  }
  EXPECT_DOUBLE_EQ(gaps.quantile(1), 1e-2);
}

TEST(GapMeter, HandlesNegativeGapsAndGapsBeyondTheLastBucket) {
  GapMeter gaps;
  gaps.add(-1e-7);
  gaps.add(1e9);
  EXPECT_EQ(gaps.count(), 2u);
  EXPECT_NEAR(gaps.quantile(.5), 0, 1.1e-6) << "the end of the first bucket";
  EXPECT_DOUBLE_EQ(gaps.quantile(1), 1e9);
}

const auto kLeaseSpan =
    trace::parse_traceparent("00-0af7651916cd43dd8448eb211c80319c-b7ad6b7169203331-01").value();

TEST_F(AgentTest, RecordsItsSpansAsChildrenOfTheLeasesSpan) {
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

TEST_F(AgentTest, RecordsNothingForAnUntracedLease) {
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
