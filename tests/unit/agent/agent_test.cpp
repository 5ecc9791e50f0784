// The agent with real threads, the fake renderer and a scripted coordinator.
#include "worker/agent/agent.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/agent/agent_rig.h"
#include "worker/fake/fake_pixels.h"

namespace ls::worker {
namespace {

using testing::HasSubstr;

TEST_F(AgentTest, RendersEveryUnitToTheRightBitsOnAnyNumberOfThreads) {
  start({.threads = 3});

  coordinator_.tell(assign("l-1", "j-1", tiles_up_to(20)));
  coordinator_.tell(assign("l-2", "j-2", tiles_up_to(20), 2));
  coordinator_.wait_for([](auto& c) { return c.results.size() == 40; });

  ASSERT_TRUE(drain());
  for (const UnitResult& r : coordinator_.results) {
    const std::uint64_t seed = r.unit.job.value == "j-1" ? 1 : 2;
    const RenderSettings s = settings(seed);
    const PixelRect rect = TileGrid{s.size, s.tile}.rect(r.unit.tile);
    const UnitHeader header{
        sha256(std::string_view("scene")), digest_of(s), fake_numeric_class(), rect, {0, 2}};
    const auto partial = decode_partial(r.exr, header, s.size);
    ASSERT_TRUE(partial) << partial.error().message;
    EXPECT_EQ(*partial, fake_partial(header));
    EXPECT_EQ(r.digest, unit_digest(*partial));
    EXPECT_EQ(r.lease.value, seed == 1 ? "l-1" : "l-2");
  }
}

TEST_F(AgentTest, ResendsUnacknowledgedResultsWithItsOldIdAfterAReconnect) {
  coordinator_.acknowledge_results(false);
  start();
  coordinator_.tell(assign("l-1", "j-1", tiles_up_to(5)));
  coordinator_.wait_for([](auto& c) { return c.results.size() == 5; });

  coordinator_.acknowledge_results(true);
  coordinator_.cut();
  wait_while_time_passes([](auto& c) { return c.hellos.size() == 2; });
  coordinator_.wait_for([](auto& c) { return c.results.size() == 10; });

  EXPECT_TRUE(drain());
  EXPECT_EQ(coordinator_.hellos[0].secret, "") << "it has none yet, and will keep one";
  EXPECT_EQ(coordinator_.hellos[1].previous_id, WorkerId{"w-1"});
  EXPECT_EQ(coordinator_.hellos[1].secret, "secret of w-1");
  for (std::size_t i = 0; i < 5; ++i) EXPECT_EQ(coordinator_.results[i], coordinator_.results[i + 5]);
}

TEST_F(AgentTest, KeepsRenderingWhileDisconnectedUntilTheOutboxIsFull) {
  const std::size_t one = 6 * 4 * 64;  // least size of a result: the bytes of its floats
  coordinator_.acknowledge_results(false);
  start({.outbox_bytes = 3 * one});

  coordinator_.tell(assign("l-1", "j-1", tiles_up_to(60)));
  coordinator_.wait_for([](auto& c) { return c.results.size() >= 2; });
  wait_while_time_passes([](auto& c) { return c.progress.size() >= 5; });

  // The third result fills the outbox at the latest; a fourth unit may have been begun before that.
  agent_->stop();
  join();
  EXPECT_LE(coordinator_.results.size(), 4U);
}

TEST_F(AgentTest, DeliversTheRunningUnitAndReturnsTheRestOnDrain) {
  start({}, {.delay = std::chrono::milliseconds(20)});
  coordinator_.tell(assign("l-1", "j-1", tiles_up_to(50)));
  coordinator_.wait_for([](auto& c) { return c.results.size() >= 2; });

  ASSERT_TRUE(drain());

  std::set<TileIndex> back;
  for (const LeaseReturned& r : coordinator_.returned)
    for (const UnitKey& k : r.unrendered) back.insert(k.tile);
  EXPECT_EQ(coordinator_.draining, 1);
  EXPECT_EQ(back.size() + tiles_of(coordinator_.results).size(), 50U);
}

TEST_F(AgentTest, DrainsOnTheCoordinatorsRequest) {
  start();

  coordinator_.tell(DrainNow{});

  EXPECT_TRUE(join());
}

TEST_F(AgentTest, TakesLeasesAgainWhenTheCoordinatorWithdrawsItsDrain) {
  coordinator_.acknowledge_results(false);  // so that it has not drained before
  start();
  coordinator_.tell(assign("l-1", "j-1", {0}));
  coordinator_.wait_for([](auto& c) { return c.results.size() == 1; });
  coordinator_.tell(DrainNow{});
  coordinator_.wait_for([](auto& c) { return c.draining == 1; });

  coordinator_.tell(DrainNow{.withdrawn = true});
  coordinator_.wait_for([](auto& c) { return c.undrained == 1; });
  coordinator_.tell(assign("l-2", "j-1", {1}));
  coordinator_.wait_for([](auto& c) { return c.results.size() == 2; });

  EXPECT_TRUE(coordinator_.returned.empty());
}

class RestartTest : public AgentTest {
 protected:
  // Starts a worker that may restart and has a unit whose result waits for its acknowledgement, so that it
  // does not drain before the test has looked at it.
  void start_busy(AgentOptions options = {}) {
    coordinator_.acknowledge_results(false);
    options.may_restart = [this] { return may_; };
    start(std::move(options));
    coordinator_.tell(assign("l-1", "j-1", {0}));
    coordinator_.wait_for([](auto& c) { return c.results.size() == 1; });
  }
  void tell(DrainNow asked) {
    const std::size_t before = coordinator_.drains.size();
    coordinator_.tell(asked);
    coordinator_.wait_for([&](auto& c) { return c.drains.size() == before + 1; });
  }
  void acknowledge() { coordinator_.tell(ResultAck{{JobId{"j-1"}, 0, 0}, {}}); }
  Result<void> may_;
};

TEST_F(RestartTest, DeliversItsResultsAndThenRestarts) {
  start_busy();
  EXPECT_TRUE(coordinator_.hellos[0].restarts);

  tell({.restart = true});
  EXPECT_EQ(coordinator_.drains.back(), WorkerDraining{.restarts = true});
  coordinator_.tell(assign("l-2", "j-1", {1}));
  coordinator_.wait_for([](auto& c) { return c.returned.size() == 1; });
  coordinator_.tell(DrainNow{.restart = true});  // a second one changes nothing
  acknowledge();

  EXPECT_TRUE(join());
  EXPECT_TRUE(agent_->to_restart());
  EXPECT_EQ(coordinator_.drains.size(), 1U);
}

TEST_F(RestartTest, TheLatestRequestApplies) {
  start_busy();

  tell({});
  tell({.restart = true});
  EXPECT_EQ(coordinator_.drains.back(), WorkerDraining{.restarts = true});
  tell({.withdrawn = true});
  EXPECT_EQ(coordinator_.drains.back(), WorkerDraining{.withdrawn = true});
  tell({.restart = true});
  tell({});
  EXPECT_EQ(coordinator_.drains.back(), WorkerDraining{});
  acknowledge();

  EXPECT_TRUE(join());
  EXPECT_FALSE(agent_->to_restart());
}

TEST_F(RestartTest, EndsIfASignalAsksForThatToo) {
  start_busy();
  tell({.restart = true});

  agent_->drain();
  coordinator_.wait_for([](auto& c) { return c.drains.size() == 2; });
  acknowledge();

  EXPECT_TRUE(join());
  EXPECT_FALSE(agent_->to_restart());
}

TEST_F(RestartTest, WorksOnAndSaysWhyIfItsProgramCannotBeRun) {
  start_busy();
  may_ = fail(Errc::failed_precondition, "/opt/worker is gone");

  tell({.restart = true});

  EXPECT_EQ(coordinator_.drains.back(),
            (WorkerDraining{.withdrawn = true, .restarts = false, .refused = "/opt/worker is gone"}));
  coordinator_.tell(assign("l-2", "j-1", {1}));
  coordinator_.wait_for([](auto& c) { return c.results.size() == 2; });
  wait_while_time_passes([](auto& c) {
    return !c.progress.empty() && c.progress.back().activity == "does not restart: /opt/worker is gone";
  });
  pass(std::chrono::seconds(60));
  wait_while_time_passes([](auto& c) { return c.progress.back().activity == "idle"; });
}

TEST_F(RestartTest, DrainsOnIfARestartIsRefusedMeanwhile) {
  start_busy();
  tell({});
  may_ = fail(Errc::failed_precondition, "gone");

  tell({.restart = true});
  EXPECT_EQ(coordinator_.drains.back(),
            (WorkerDraining{.withdrawn = false, .restarts = false, .refused = "gone"}));
  acknowledge();

  EXPECT_TRUE(join());
  EXPECT_FALSE(agent_->to_restart());
}

TEST_F(RestartTest, RestartsAtItsLimitThoughResultsAreLost) {
  start_busy({.drain_limit = std::chrono::seconds(5)});
  tell({.restart = true});

  pass(std::chrono::seconds(6));

  EXPECT_TRUE(join());
  EXPECT_TRUE(agent_->to_restart());
}

TEST_F(RestartTest, SaysAgainAfterALostConnectionThatItRestarts) {
  start_busy();
  tell({.restart = true});

  coordinator_.cut();
  wait_while_time_passes([](auto& c) { return c.hellos.size() == 2 && c.drains.size() == 2; });

  EXPECT_EQ(coordinator_.drains.back(), WorkerDraining{.restarts = true});
}

TEST_F(AgentTest, OffersNoRestartIfItsProgramCannotDoIt) {
  start();
  EXPECT_FALSE(coordinator_.hellos[0].restarts);
  coordinator_.tell(DrainNow{.restart = true});
  coordinator_.wait_for([](auto& c) { return c.drains.size() == 1; });
  EXPECT_EQ(coordinator_.drains[0].refused, "this worker cannot restart");
}

TEST_F(AgentTest, EndsForItsOwnReasonsThoughTheCoordinatorWithdrawsADrain) {
  coordinator_.acknowledge_results(false);
  start({.drain_limit = std::chrono::seconds(5)});
  coordinator_.tell(assign("l-1", "j-1", {0}));
  coordinator_.wait_for([](auto& c) { return c.results.size() == 1; });
  agent_->drain();
  coordinator_.wait_for([](auto& c) { return c.draining == 1; });

  coordinator_.tell(DrainNow{.withdrawn = true});
  wait_while_time_passes(
      [](auto& c) { return c.progress.size() > 1 && c.progress.back().activity == "draining"; });
  pass(std::chrono::seconds(6));

  EXPECT_FALSE(join());
  EXPECT_EQ(coordinator_.undrained, 0);
}

TEST_F(AgentTest, EndsWhenItHasHadNoWorkForItsIdleLimit) {
  start({.idle_limit = std::chrono::seconds(60)});
  pass(std::chrono::seconds(59));
  coordinator_.tell(assign("l-1", "j-1", {0, 1}));
  coordinator_.wait_for([](auto& c) { return c.results.size() == 2; });

  // The start was 118 s ago, but the last work only 59 s: the agent still takes a lease.
  pass(std::chrono::seconds(59));
  coordinator_.tell(assign("l-2", "j-1", {2}));
  coordinator_.wait_for([](auto& c) { return c.results.size() == 3; });

  wait_while_time_passes([](auto& c) { return c.draining == 1; });
  EXPECT_TRUE(join());
  EXPECT_TRUE(coordinator_.returned.empty());
}

TEST_F(AgentTest, DoesNotEndWhileAUnitTakesLongerThanTheIdleLimit) {
  start({.idle_limit = std::chrono::seconds(60)}, {.fault = {FakeFault::Kind::hang, 1}});
  coordinator_.tell(assign("l-1", "j-1", {0}));
  wait_while_time_passes([](auto& c) {
    return !c.progress.empty() && c.progress.back().activity == "rendering" && c.progress.size() > 80;
  });

  EXPECT_EQ(coordinator_.draining, 0);
}

TEST_F(AgentTest, FailsWhenItHasNotJoinedWithinItsIdleLimit) {
  coordinator_.answer_hello_with(Refused{{Errc::unavailable, "starting"}, true});
  start({.idle_limit = std::chrono::seconds(60)});

  pass(std::chrono::seconds(61));

  EXPECT_THAT(join().error().message, HasSubstr("did not join the coordinator within 60 s"));
}

TEST_F(AgentTest, StopsDrainingAtItsLimitAndReportsWhatIsLost) {
  coordinator_.acknowledge_results(false);
  start({.drain_limit = std::chrono::seconds(5)});
  coordinator_.tell(assign("l-1", "j-1", {0}));
  coordinator_.wait_for([](auto& c) { return c.results.size() == 1; });

  agent_->drain();
  coordinator_.wait_for([](auto& c) { return c.draining == 1; });
  pass(std::chrono::seconds(6));

  EXPECT_THAT(join().error().message, HasSubstr("1 finished units"));
}

TEST_F(AgentTest, StopsTheUnitsOfACancelledJob) {
  start({}, {.fault = {FakeFault::Kind::hang, 1}});
  coordinator_.tell(assign("l-1", "j-1", {0, 1, 2}, 1));

  coordinator_.tell(CancelJob{JobId{"j-1"}});
  coordinator_.tell(assign("l-2", "j-2", {7}, 2));
  coordinator_.wait_for([](auto& c) { return c.results.size() == 1; });

  EXPECT_TRUE(drain());
  EXPECT_EQ(tiles_of(coordinator_.results), std::set<TileIndex>{7});
  EXPECT_TRUE(coordinator_.failures.empty());
}

TEST_F(AgentTest, RendersTheOthersWhenOneLeaseIsCancelled) {
  start({}, {.fault = {FakeFault::Kind::hang, -1, 0}});
  coordinator_.tell(assign("l-1", "j-1", {0}));
  coordinator_.tell(assign("l-2", "j-1", {1}));

  coordinator_.tell(CancelLease{LeaseId{"l-1"}});

  coordinator_.wait_for([](auto& c) { return tiles_of(c.results) == std::set<TileIndex>{1}; });
  EXPECT_TRUE(drain());
}

// Its only thread hangs in the first unit of the lease.
TEST_F(AgentTest, ReturnsUnstartedUnitsOfARecalledLease) {
  start({}, {.fault = {FakeFault::Kind::hang, -1, 0}});
  coordinator_.tell(assign("l-1", "j-1", {0, 1, 2}));
  coordinator_.tell(assign("l-2", "j-1", {3}));
  wait_while_time_passes(
      [](auto& c) { return !c.progress.empty() && c.progress.back().activity == "rendering"; });

  coordinator_.tell(RecallLease{LeaseId{"l-1"}});
  coordinator_.wait_for([](auto& c) { return !c.returned.empty(); });

  const LeaseReturned rest{LeaseId{"l-1"}, {{JobId{"j-1"}, 1, 0}, {JobId{"j-1"}, 2, 0}}};
  EXPECT_EQ(coordinator_.returned, std::vector{rest});
  EXPECT_EQ(coordinator_.draining, 0);
  coordinator_.tell(CancelLease{LeaseId{"l-1"}});
  coordinator_.wait_for([](auto& c) { return tiles_of(c.results) == std::set<TileIndex>{3}; });
}

TEST_F(AgentTest, EndsWithTheCoordinatorsReasonWhenPermanentlyRefused) {
  coordinator_.answer_hello_with(Refused{{Errc::unauthenticated, "wrong join token"}, false});
  start();

  EXPECT_EQ(join().error(), (Error{Errc::unauthenticated, "wrong join token"}));
}

TEST_F(AgentTest, ReconnectsAfterATemporaryRefusal) {
  coordinator_.answer_hello_with(Refused{{Errc::unavailable, "starting"}, true});
  start();
  coordinator_.answer_hello_with(Welcome{WorkerId{"w-2"}, 1});

  wait_while_time_passes([](auto& c) { return c.hellos.size() >= 2; });

  EXPECT_TRUE(drain());
}

TEST_F(AgentTest, ContinuesAfterABrokenTransfer) {
  coordinator_.cut_next_fetch();
  start();

  coordinator_.tell(assign("l-1", "j-1", {0}));
  wait_while_time_passes([](auto& c) { return c.results.size() == 1; });

  EXPECT_TRUE(drain());
}

TEST_F(AgentTest, ReportsOneFailureAndReturnsTheOtherUnitsIfAJobCannotBeLoaded) {
  start();
  AssignLease a = assign("l-1", "j-1", tiles_up_to(10));
  a.brief->assets.push_back({sha256(std::string_view("lost")), 4, "steam.vdb"});

  coordinator_.tell(a);
  coordinator_.wait_for([](auto& c) { return c.failures.size() == 1 && c.returned.size() == 1; });

  EXPECT_TRUE(drain());
  EXPECT_THAT(coordinator_.failures[0].reason, HasSubstr("steam.vdb"));
  EXPECT_EQ(coordinator_.failures[0].lease, LeaseId{"l-1"});
  EXPECT_EQ(coordinator_.returned[0].unrendered.size(), 9U);
}

TEST_F(AgentTest, RendersAFailedUnitAgainIfRequested) {
  start();
  AssignLease a = assign("l-1", "j-1", {0});
  a.brief->assets.push_back({sha256(std::string_view("late")), 4, "late.vdb"});
  coordinator_.tell(a);
  coordinator_.wait_for([](auto& c) { return c.failures.size() == 1; });

  coordinator_.add_blob("late");
  a.lease.id = LeaseId{"l-2"};
  coordinator_.tell(a);

  coordinator_.wait_for([](auto& c) { return c.results.size() == 1; });
  EXPECT_TRUE(drain());
  EXPECT_EQ(coordinator_.results[0].lease, LeaseId{"l-2"});
}

TEST_F(AgentTest, RefusesATileWhoseResultExceedsAMessage) {
  start();
  AssignLease a = assign("l-1", "j-1", {0});
  a.lease.units[0].rect = {0, 0, 400, 400};

  coordinator_.tell(a);
  coordinator_.wait_for([](auto& c) { return c.failures.size() == 1; });

  EXPECT_TRUE(drain());
  EXPECT_TRUE(coordinator_.failures[0].scene_at_fault);
  EXPECT_THAT(coordinator_.failures[0].reason, HasSubstr("smaller tile"));
}

TEST_F(AgentTest, ReturnsALeaseOfAnUnknownJob) {
  start();
  AssignLease a = assign("l-1", "j-1", {0, 1});
  a.brief.reset();

  coordinator_.tell(a);

  coordinator_.wait_for(
      [](auto& c) { return c.returned.size() == 1 && c.returned[0].unrendered.size() == 2; });
  EXPECT_TRUE(drain());
}

std::size_t briefs_size() { return memory_of(*assign("l", "j-000", {0}).brief); }

// The coordinator's side: leases of many jobs in turn, with a brief only if the worker does not remember it.
TEST_F(AgentTest, RemembersTheJobsThatTheCoordinatorExpects) {
  constexpr int kJobs = 200, kLeases = 600;
  start();
  coordinator_.wait_for([](auto& c) { return c.hellos.size() == 1; });
  BriefMemory<std::string> known(coordinator_.hellos[0].brief_bytes);
  int briefs = 0;

  for (int i = 0; i < kLeases; ++i) {
    const std::string job = fmt::format("j-{}", i % kJobs);
    AssignLease a = assign(fmt::format("l-{}", i).c_str(), job.c_str(), {static_cast<TileIndex>(i / kJobs)});
    const auto bytes = known.has(job) ? std::nullopt : std::optional(memory_of(*a.brief));
    if (!bytes) a.brief.reset();
    briefs += bytes.has_value();
    known.leased(job, bytes);
    coordinator_.tell(a);
  }

  coordinator_.wait_for([](auto& c) { return c.results.size() + c.returned.size() == kLeases; });
  EXPECT_TRUE(drain());
  EXPECT_EQ(briefs, kJobs) << "the memory is large enough for all of them";
  EXPECT_EQ(coordinator_.results.size(), kLeases);
}

TEST_F(AgentTest, ForgetsJobsWhoseBriefsDoNotFitAndReportsThem) {
  AgentOptions options;
  options.brief_bytes = 2 * briefs_size();
  start(options);
  for (const char* job : {"j-001", "j-002", "j-003"}) {
    coordinator_.tell(assign(job, job, {0}));
    coordinator_.wait_for(
        [&](auto& c) { return !c.results.empty() && c.results.back().unit.job.value == job; });
  }

  for (const char* job : {"j-003", "j-002", "j-001"}) {
    AssignLease again = assign(job, job, {1});
    again.brief.reset();
    coordinator_.tell(again);
  }

  coordinator_.wait_for([](auto& c) { return c.results.size() == 5 && c.returned.size() == 1; });
  EXPECT_TRUE(drain());
  EXPECT_EQ(coordinator_.returned[0].lease, LeaseId{"j-001"});
  EXPECT_TRUE(coordinator_.returned[0].unknown_job);
}

TEST_F(AgentTest, ReportsItsLeasesOnceASecond) {
  start({}, {.fault = {FakeFault::Kind::hang}});
  coordinator_.tell(assign("l-1", "j-1", {0}));

  wait_while_time_passes([](auto& c) {
    return std::count_if(c.progress.begin(), c.progress.end(), [](const WorkerProgress& p) {
             return p.leases == std::vector<WorkerProgress::Entry>{{LeaseId{"l-1"}, 0}} &&
                    p.activity == "rendering";
           }) >= 3;
  });
}

}  // namespace
}  // namespace ls::worker
