// The times that an agent reports besides rendering: loading, idling and waiting.
#include <numeric>

#include "tests/unit/agent/agent_rig.h"

namespace ls::worker {
namespace {

// The fake renderer on a clock that advances only when it prepares a job (by 2 s) and when it renders a unit:
// by 3/4 s, of which it reports 1/2 s as rendering, with 1/8 s of CPU time; the other 1/4 s counts as idle.
class TimedBackend final : public RenderBackend {
 public:
  TimedBackend(std::unique_ptr<RenderBackend> fake, FakeClock& clock)
      : fake_(std::move(fake)), clock_(clock) {}
  Digest numeric_class() const override { return fake_->numeric_class(); }
  tl::expected<void, UnitFailure> prepare(const LocalJob& job) override {
    clock_.advance(std::chrono::seconds(2));
    return fake_->prepare(job);
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

TEST_F(AgentTest, TellsWhatLoadingTookOnceAndHowLongItsThreadStoodStillOrWaited) {
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

}  // namespace
}  // namespace ls::worker
