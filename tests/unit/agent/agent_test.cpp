// The agent with real threads, the fake renderer and a scripted coordinator.
#include "worker/agent/agent.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>
#include <thread>

#include "common/image/fake_pixels.h"
#include "tests/unit/agent/scripted_coordinator.h"
#include "worker/fake/fake.h"

namespace ls::worker {
namespace {

using testing::HasSubstr;

class AtomicClock final : public Clock {
 public:
  TimePoint now() const override { return TimePoint(Duration(now_.load())); }
  void advance(Duration d) { now_ += d.count(); }

 private:
  std::atomic<Duration::rep> now_{1'000'000'000};
};

// Blobs straight from the coordinator, no disk.
class FetchedFiles final : public BlobFiles {
 public:
  explicit FetchedFiles(CoordinatorLink& link) : link_(link) {}
  Result<std::shared_ptr<const BlobFile>> acquire(const BlobRef& blob) override {
    struct File final : BlobFile {
      const std::filesystem::path& path() const override { return file; }
      std::filesystem::path file = "blob";
    };
    const auto ok =
        link_.fetch_blob(blob.digest, 0, [](std::span<const std::byte>) { return Result<void>{}; });
    if (!ok) return tl::unexpected<Error>(ok.error());
    return std::make_shared<const File>();
  }
  std::vector<Digest> held(std::size_t) const override { return {}; }

 private:
  CoordinatorLink& link_;
};

RenderSettings settings(std::uint64_t seed) {
  RenderSettings s;
  s.size = {64, 64};
  s.tile = 8;
  s.seed = seed;
  s.integrator = "volpath";
  return s;
}

AssignLease assign(const char* lease, const char* job, std::vector<TileIndex> tiles, std::uint64_t seed = 1) {
  const RenderSettings s = settings(seed);
  AssignLease a;
  a.lease = {LeaseId{lease}, JobId{job}, {}};
  for (const TileIndex t : tiles) a.lease.units.push_back({t, 0, TileGrid{s.size, s.tile}.rect(t), {0, 2}});
  a.brief = JobBrief{JobId{job}, sha256(std::string_view("scene")), s, digest_of(s), {}};
  return a;
}

std::vector<TileIndex> tiles_up_to(TileIndex n) {
  std::vector<TileIndex> tiles(n);
  for (TileIndex i = 0; i < n; ++i) tiles[i] = i;
  return tiles;
}

std::set<TileIndex> tiles_of(const std::vector<UnitResult>& results) {
  std::set<TileIndex> tiles;
  for (const UnitResult& r : results) tiles.insert(r.unit.tile);
  return tiles;
}

class AgentTest : public testing::Test {
 protected:
  void start(AgentOptions options = {}, FakeOptions fake = {}) {
    start_with(make_fake_backend(fake), std::move(options));
  }
  void start_with(std::unique_ptr<RenderBackend> backend, AgentOptions options = {}) {
    coordinator_.add_blob("scene");
    backend_ = std::move(backend);
    options.hello.name = "tester";
    agent_ = std::make_unique<Agent>(options, coordinator_, *backend_, files_, clock_);
    runner_ = std::jthread([this] { ended_ = agent_->run(); });
    coordinator_.wait_for([](auto& c) { return c.hellos.size() == 1; });
  }
  Result<void> drain() {
    agent_->drain();
    return join();
  }
  Result<void> join() {
    runner_.join();
    return ended_;
  }
  void TearDown() override {
    if (!runner_.joinable()) return;
    agent_->stop();
    runner_.join();
  }
  template <class Condition>
  void wait_while_time_passes(Condition condition) {
    coordinator_.wait_for(condition, [this] { pass(std::chrono::milliseconds(100)); });
  }
  void pass(Duration d) {
    clock_.advance(d);
    agent_->wake();
  }

  ScriptedCoordinator coordinator_;
  AtomicClock clock_;
  FetchedFiles files_{coordinator_};
  std::unique_ptr<RenderBackend> backend_;
  std::unique_ptr<Agent> agent_;
  Result<void> ended_;
  std::jthread runner_;
};

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

TEST_F(AgentTest, SendsUnacknowledgedResultsAgainAfterAReconnectAndShowsItsOldId) {
  coordinator_.acknowledge_results(false);
  start();
  coordinator_.tell(assign("l-1", "j-1", tiles_up_to(5)));
  coordinator_.wait_for([](auto& c) { return c.results.size() == 5; });

  coordinator_.acknowledge_results(true);
  coordinator_.cut();
  wait_while_time_passes([](auto& c) { return c.hellos.size() == 2; });
  coordinator_.wait_for([](auto& c) { return c.results.size() == 10; });

  EXPECT_TRUE(drain());
  EXPECT_EQ(coordinator_.hellos[1].previous_id, WorkerId{"w-1"});
  for (std::size_t i = 0; i < 5; ++i) EXPECT_EQ(coordinator_.results[i], coordinator_.results[i + 5]);
}

TEST_F(AgentTest, KeepsRenderingWhileDisconnectedUntilTheOutboxIsFull) {
  const std::size_t one = 6 * 4 * 64;  // a result counts at least its floats
  coordinator_.acknowledge_results(false);
  start({.outbox_bytes = 3 * one});

  coordinator_.tell(assign("l-1", "j-1", tiles_up_to(60)));
  coordinator_.wait_for([](auto& c) { return c.results.size() >= 2; });
  wait_while_time_passes([](auto& c) { return c.progress.size() >= 5; });

  // Three fill the outbox at the latest; a fourth may have been begun before.
  agent_->stop();
  join();
  EXPECT_LE(coordinator_.results.size(), 4U);
}

TEST_F(AgentTest, HandsInTheUnitInHandAndReturnsTheRestOnDrain) {
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

TEST_F(AgentTest, DrainsWhenTheCoordinatorSaysSo) {
  start();

  coordinator_.tell(DrainNow{});

  EXPECT_TRUE(join());
}

TEST_F(AgentTest, GivesUpDrainingAfterItsLimitAndSaysWhatIsLost) {
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

TEST_F(AgentTest, EndsWithTheCoordinatorsReasonWhenRefusedForGood) {
  coordinator_.answer_hello_with(Refused{{Errc::unauthenticated, "wrong join token"}, false});
  start();

  EXPECT_EQ(join().error(), (Error{Errc::unauthenticated, "wrong join token"}));
}

TEST_F(AgentTest, ComesBackWhenRefusedForNow) {
  coordinator_.answer_hello_with(Refused{{Errc::unavailable, "starting"}, true});
  start();
  coordinator_.answer_hello_with(Welcome{WorkerId{"w-2"}, 1});

  wait_while_time_passes([](auto& c) { return c.hellos.size() >= 2; });

  EXPECT_TRUE(drain());
}

TEST_F(AgentTest, GoesOnAfterATransferThatWasCut) {
  coordinator_.cut_next_fetch();
  start();

  coordinator_.tell(assign("l-1", "j-1", {0}));
  wait_while_time_passes([](auto& c) { return c.results.size() == 1; });

  EXPECT_TRUE(drain());
}

TEST_F(AgentTest, ReportsOneUnitAndReturnsTheRestWhenAJobCannotBeLoaded) {
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

TEST_F(AgentTest, GivesUnitsBackThatAFullDiskKeepsFromBeingLoadedAndTriesAgain) {
  start();
  coordinator_.fail_fetches_with(Error{Errc::resource_exhausted, "no space left on the disk"});
  coordinator_.tell(assign("l-1", "j-1", tiles_up_to(10)));
  wait_while_time_passes([](auto& c) {
    return c.returned.size() == 1 && !c.progress.empty() &&
           c.progress.back().activity.find("no space left on the disk") != std::string::npos;
  });
  coordinator_.fail_fetches_with({});
  coordinator_.tell(assign("l-2", "j-1", tiles_up_to(10)));
  wait_while_time_passes([](auto& c) { return c.results.size() == 10; });

  EXPECT_TRUE(drain());
  EXPECT_EQ(coordinator_.returned[0].unrendered.size(), 10U);
  EXPECT_TRUE(coordinator_.failures.empty());
}

TEST_F(AgentTest, DoesNotAskAFullDiskAgainAtOnce) {
  start();
  coordinator_.fail_fetches_with(Error{Errc::resource_exhausted, "no space left on the disk"});
  coordinator_.tell(assign("l-1", "j-1", {0}));
  coordinator_.wait_for([](auto& c) { return c.returned.size() == 1; });
  coordinator_.tell(assign("l-2", "j-1", {0}));
  coordinator_.tell(assign("l-3", "j-2", {0}, 2));
  coordinator_.wait_for([](auto& c) { return c.returned.size() == 2; });  // of the other job

  EXPECT_EQ(coordinator_.returned[1].lease, LeaseId{"l-3"});
  EXPECT_EQ(coordinator_.fetches, 2);
}

// A backend that runs out of memory wherever it is told to.
class Exhausted final : public RenderBackend {
 public:
  explicit Exhausted(bool at_loading) : at_loading_(at_loading) {}
  Digest numeric_class() const override { return {}; }
  tl::expected<void, UnitFailure> prepare(const LocalJob&) override {
    if (at_loading_) throw std::bad_alloc();
    return {};
  }
  tl::expected<RenderedUnit, UnitFailure> render(const LocalJob&, const LeaseUnit&,
                                                 const std::atomic<bool>&) override {
    throw std::bad_alloc();
  }
  void forget(const JobId&) override {}
  std::uint64_t rss_bytes() const override { return 0; }

 private:
  const bool at_loading_;
};

TEST_F(AgentTest, ReportsAUnitWhoseBackendRanOutOfMemoryAndLivesOn) {
  for (const bool at_loading : {true, false}) {
    start_with(std::make_unique<Exhausted>(at_loading));
    coordinator_.tell(assign("l-1", "j-1", {0}));
    coordinator_.wait_for([](auto& c) { return c.failures.size() == 1; });

    EXPECT_TRUE(drain());
    EXPECT_THAT(coordinator_.failures[0].reason,
                HasSubstr(at_loading ? "out of memory while loading" : "out of memory while rendering"));
    coordinator_.failures.clear();
    coordinator_.hellos.clear();
  }
}

// A backend that finds itself unable to go on at its second unit.
class Broken final : public RenderBackend {
 public:
  Digest numeric_class() const override { return fake_->numeric_class(); }
  tl::expected<void, UnitFailure> prepare(const LocalJob& job) override { return fake_->prepare(job); }
  tl::expected<RenderedUnit, UnitFailure> render(const LocalJob& job, const LeaseUnit& unit,
                                                 const std::atomic<bool>& stop) override {
    if (unit.tile == 0) return fake_->render(job, unit, stop);
    broken_ = true;
    return tl::unexpected<UnitFailure>(UnitFailure{.reason = "replaced"});
  }
  void forget(const JobId& job) override { fake_->forget(job); }
  std::uint64_t rss_bytes() const override { return 0; }
  std::optional<Error> broken() const override {
    return broken_ ? std::optional(Error{Errc::failed_precondition, "the program was replaced"})
                   : std::nullopt;
  }

 private:
  std::unique_ptr<LocalBackend> fake_ = make_fake_backend({});
  std::atomic<bool> broken_{false};
};

TEST_F(AgentTest, EndsWithABrokenBackendsErrorAfterGivingUnitsBackUnharmed) {
  start_with(std::make_unique<Broken>());
  coordinator_.tell(assign("l-1", "j-1", tiles_up_to(10)));

  EXPECT_EQ(join().error().message, "the program was replaced");
  EXPECT_EQ(coordinator_.results.size(), 1U);
  EXPECT_TRUE(coordinator_.failures.empty());
  std::size_t returned = 0;
  for (const LeaseReturned& r : coordinator_.returned) returned += r.unrendered.size();
  EXPECT_EQ(returned, 9U);
}

TEST_F(AgentTest, TriesAUnitAgainThatItReportedAsFailed) {
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

TEST_F(AgentTest, RefusesATileWhoseResultFitsNoMessage) {
  start();
  AssignLease a = assign("l-1", "j-1", {0});
  a.lease.units[0].rect = {0, 0, 400, 400};

  coordinator_.tell(a);
  coordinator_.wait_for([](auto& c) { return c.failures.size() == 1; });

  EXPECT_TRUE(drain());
  EXPECT_TRUE(coordinator_.failures[0].scene_at_fault);
  EXPECT_THAT(coordinator_.failures[0].reason, HasSubstr("smaller tile"));
}

TEST_F(AgentTest, ReturnsALeaseOfAJobThatItWasNotToldAbout) {
  start();
  AssignLease a = assign("l-1", "j-1", {0, 1});
  a.brief.reset();

  coordinator_.tell(a);

  coordinator_.wait_for(
      [](auto& c) { return c.returned.size() == 1 && c.returned[0].unrendered.size() == 2; });
  EXPECT_TRUE(drain());
}

TEST_F(AgentTest, NamesItsLeasesOnceASecondWhileItWorks) {
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
