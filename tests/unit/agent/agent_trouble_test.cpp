// An agent whose machine or backend is in trouble.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fmt/format.h>

#include <filesystem>
#include <fstream>
#include <mutex>
#include <new>
#include <semaphore>
#include <set>
#include <thread>

#include "tests/unit/agent/agent_rig.h"
#include "worker/agent/agent_impl.h"

namespace ls::worker {
namespace {

using testing::HasSubstr;
using AgentInTrouble = AgentTest;

TEST_F(AgentInTrouble, ReturnsUnitsThatAFullDiskPreventsFromLoadingAndRetriesLater) {
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

TEST_F(AgentInTrouble, DoesNotRetryAFullDiskAtOnce) {
  start();
  coordinator_.fail_fetches_with(Error{Errc::resource_exhausted, "no space left on the disk"});
  coordinator_.tell(assign("l-1", "j-1", {0}));
  coordinator_.wait_for([](auto& c) { return c.returned.size() == 1; });
  coordinator_.tell(assign("l-2", "j-1", {0}));
  coordinator_.tell(assign("l-3", "j-2", {0}, 2));
  coordinator_.wait_for([](auto& c) { return c.returned.size() == 2; });  // the second is of the other job

  EXPECT_EQ(coordinator_.returned[1].lease, LeaseId{"l-3"});
  EXPECT_EQ(coordinator_.fetches, 2);
}

// A backend that runs out of memory while it loads a scene or, if not `at_loading`, while it renders.
class Exhausted final : public RenderBackend {
 public:
  explicit Exhausted(bool at_loading) : at_loading_(at_loading) {}
  Digest numeric_class() const override { return {}; }
  tl::expected<void, UnitFailure> prepare(const LocalJob&, const std::atomic<bool>&) override {
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

TEST_F(AgentInTrouble, ReportsAUnitThatRanOutOfMemoryAndContinues) {
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

// A backend whose world of the job with seed 1 is never ready: building it ends when told to stop or, if the
// backend is `deaf`, fails or is done when the test says so.
class Building final : public RenderBackend {
 public:
  explicit Building(bool deaf) : deaf_(deaf) {}
  Digest numeric_class() const override { return fake_->numeric_class(); }
  tl::expected<void, UnitFailure> prepare(const LocalJob& job, const std::atomic<bool>& stop) override {
    if (job.brief.settings.seed != 1) return ++others_built, fake_->prepare(job, stop);
    building = true;
    while (deaf_ ? !fail && !done : !stop) std::this_thread::yield();
    if (done) return {};
    return unit_failure(deaf_ ? "the world cannot be built" : "told to stop");
  }
  tl::expected<RenderedUnit, UnitFailure> render(const LocalJob& job, const LeaseUnit& unit,
                                                 const std::atomic<bool>& stop) override {
    return fake_->render(job, unit, stop);
  }
  void forget(const JobId& job) override { fake_->forget(job); }
  std::uint64_t rss_bytes() const override { return 0; }

  std::atomic<bool> building{false}, fail{false}, done{false};
  std::atomic<int> others_built = 0;

 private:
  const bool deaf_;
  const std::unique_ptr<RenderBackend> fake_ = make_fake_backend({});
};

class AgentThatBuilds : public AgentTest {
 protected:
  // Starts an agent that is building the world of j-1 for lease l-1.
  Building& start_building(bool deaf) {
    auto made = std::make_unique<Building>(deaf);
    Building& backend = *made;
    start_with(std::move(made));
    coordinator_.tell(assign("l-1", "j-1", {0, 1}, 1));
    while (!backend.building) std::this_thread::yield();
    return backend;
  }
  void expect_that_only_tile_7_was_rendered() {
    coordinator_.wait_for([](auto& c) { return c.results.size() == 1; });
    EXPECT_TRUE(drain());
    EXPECT_EQ(tiles_of(coordinator_.results), std::set<TileIndex>{7});
    EXPECT_TRUE(coordinator_.failures.empty());
  }
};

TEST_F(AgentThatBuilds, AbandonsTheWorldOfACancelledJob) {
  start_building(false);

  coordinator_.tell(CancelJob{JobId{"j-1"}});
  coordinator_.tell(assign("l-2", "j-2", {7}, 2));

  expect_that_only_tile_7_was_rendered();
}

TEST_F(AgentThatBuilds, AbandonsTheWorldOfARecalledLease) {
  start_building(false);

  coordinator_.tell(CancelLease{LeaseId{"l-1"}});
  coordinator_.tell(assign("l-2", "j-2", {7}, 2));

  expect_that_only_tile_7_was_rendered();
}

TEST_F(AgentThatBuilds, KeepsBuildingAWorldThatAnotherLeaseNeeds) {
  Building& backend = start_building(true);
  coordinator_.tell(assign("l-2", "j-1", {2}, 1));

  coordinator_.tell(CancelLease{LeaseId{"l-1"}});
  // Messages are handled in order: once the lease of an unknown job came back, the other one is cancelled.
  AssignLease unknown = assign("l-3", "j-3", {0}, 1);
  unknown.brief.reset();
  coordinator_.tell(std::move(unknown));
  coordinator_.wait_for([](auto& c) { return c.returned.size() == 1; });
  backend.fail = true;

  coordinator_.wait_for([](auto& c) { return c.failures.size() == 1; });
  EXPECT_EQ(coordinator_.failures[0].lease, LeaseId{"l-2"});
}

// The id of the job that is being built is given to another job, whose units are no part of the failure.
TEST_F(AgentThatBuilds, ReportsNoFailureForAJobThatReplacedOneThatFailedToBuild) {
  Building& backend = start_building(true);

  coordinator_.tell(assign("l-2", "j-1", {7}, 2));
  // The agent has taken the lease once it answers to a later one, which it gives back because it is unknown.
  AssignLease unknown = assign("l-3", "j-3", {3});
  unknown.brief.reset();
  coordinator_.tell(unknown);
  coordinator_.wait_for([](auto& c) { return c.returned.size() == 1; });
  backend.fail = true;

  expect_that_only_tile_7_was_rendered();
}

TEST_F(AgentThatBuilds, BuildsTheWorldOfAJobThatReplacedAnotherDuringItsBuild) {
  Building& backend = start_building(true);

  coordinator_.tell(assign("l-2", "j-1", {7}, 2));
  AssignLease unknown = assign("l-3", "j-3", {3});
  unknown.brief.reset();
  coordinator_.tell(unknown);
  coordinator_.wait_for([](auto& c) { return c.returned.size() == 1; });
  backend.done = true;

  expect_that_only_tile_7_was_rendered();
  EXPECT_EQ(backend.others_built, 1);
}

TEST_F(AgentThatBuilds, EndsWithoutWaitingForTheWorld) {
  start_building(false);

  agent_->stop();

  EXPECT_TRUE(join());
}

// A backend that renders tile 0 and reports itself as broken at any other tile.
class Broken final : public RenderBackend {
 public:
  Digest numeric_class() const override { return fake_->numeric_class(); }
  tl::expected<void, UnitFailure> prepare(const LocalJob& job, const std::atomic<bool>& stop) override {
    return fake_->prepare(job, stop);
  }
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

TEST_F(AgentInTrouble, ReturnsItsUnitsAndEndsWithTheErrorOfABrokenBackend) {
  start_with(std::make_unique<Broken>());
  coordinator_.tell(assign("l-1", "j-1", tiles_up_to(10)));

  EXPECT_EQ(join().error().message, "the program was replaced");
  EXPECT_EQ(coordinator_.results.size(), 1U);
  EXPECT_TRUE(coordinator_.failures.empty());
  std::size_t returned = 0;
  for (const LeaseReturned& r : coordinator_.returned) returned += r.unrendered.size();
  EXPECT_EQ(returned, 9U);
}

TEST_F(AgentInTrouble, ReturnsUnitsWhoseFilesNeverArriveIntactAndSaysWhy) {
  start();
  coordinator_.fail_fetches_with(Error{Errc::unavailable, "the line was cut"});
  coordinator_.tell(assign("l-1", "j-1", {0, 1}));

  coordinator_.wait_for(
      [](auto& c) { return c.returned.size() == 1; },
      [&] {
        pass(std::chrono::milliseconds(500));
        coordinator_.tell(ResultAck{{JobId{"j-0"}, 0, 0}, {}});  // makes the loader look again
      });

  EXPECT_TRUE(drain());
  EXPECT_EQ(coordinator_.returned[0].unrendered.size(), 2U);
  EXPECT_THAT(coordinator_.returned[0].reason, HasSubstr("the line was cut"));
}

// Hands out files that can be removed, as somebody who cleans up a cache does.
class RemovableFiles final : public BlobFiles {
 public:
  explicit RemovableFiles(std::filesystem::path path) : path_(std::move(path)) {}
  Result<std::shared_ptr<const BlobFile>> acquire(const BlobRef&, const std::atomic<bool>&) override {
    std::ofstream(path_) << "scene";
    ++acquired;
    struct File final : BlobFile {
      const std::filesystem::path& path() const override { return file; }
      std::filesystem::path file;
    };
    auto file = std::make_shared<File>();
    file->file = path_;
    return std::shared_ptr<const BlobFile>(std::move(file));
  }
  std::vector<Digest> held(std::size_t) const override { return {}; }

  std::atomic<int> acquired = 0;

 private:
  const std::filesystem::path path_;
};

// A backend that needs the scene's file for each unit, as a new render child does.
class NeedsItsFile final : public RenderBackend {
 public:
  Digest numeric_class() const override { return fake_->numeric_class(); }
  tl::expected<void, UnitFailure> prepare(const LocalJob& job, const std::atomic<bool>& stop) override {
    const std::lock_guard lock(mutex_);
    built += worlds_.insert(key_of(job.brief)).second;
    return fake_->prepare(job, stop);
  }
  // Tile 9 finds no file, too, but says so only when the test lets it.
  tl::expected<RenderedUnit, UnitFailure> render(const LocalJob& job, const LeaseUnit& unit,
                                                 const std::atomic<bool>& stop) override {
    if (unit.tile == 9) {
      begun.release();
      fail.acquire();
      return unit_failure("cannot open the scene");
    }
    if (!std::filesystem::exists(job.scene)) return unit_failure("cannot open the scene");
    return fake_->render(job, unit, stop);
  }
  void forget(const JobId& job) override {
    const std::lock_guard lock(mutex_);
    std::erase_if(worlds_, [&](const WorldKey& key) { return key.job == job; });
  }
  std::uint64_t rss_bytes() const override { return 0; }

  std::atomic<int> built = 0;
  std::counting_semaphore<> begun{0}, fail{0};

 private:
  std::unique_ptr<LocalBackend> fake_ = make_fake_backend({});
  std::mutex mutex_;
  std::set<WorldKey> worlds_;
};

TEST_F(AgentInTrouble, RefetchesFilesThatWereRemovedWhileRenderingWithoutFailingUnits) {
  const std::filesystem::path path = std::filesystem::path(testing::TempDir()) / "removed-scene";
  RemovableFiles files(path);
  NeedsItsFile backend;
  Agent agent({}, coordinator_, backend, files, clock_);
  std::jthread runner([&] { ended_ = agent.run(); });
  coordinator_.wait_for([](auto& c) { return c.hellos.size() == 1; });
  coordinator_.tell(assign("l-1", "j-1", {0}));
  coordinator_.wait_for([](auto& c) { return c.results.size() == 1; });

  std::filesystem::remove(path);
  coordinator_.tell(assign("l-2", "j-1", {1}));
  coordinator_.wait_for([](auto& c) { return c.returned.size() == 1; });
  coordinator_.tell(assign("l-3", "j-1", {1}));
  coordinator_.wait_for([](auto& c) { return c.results.size() == 2; });

  agent.drain();
  runner.join();
  std::filesystem::remove(path);
  EXPECT_TRUE(coordinator_.failures.empty());
  EXPECT_THAT(coordinator_.returned[0].reason, HasSubstr("removed from the cache"));
  EXPECT_EQ(files.acquired, 2);
  EXPECT_EQ(backend.built, 2) << "the world whose file was lost is freed";
}

// Two threads miss the file. Until the second one has said so, somebody has put the file back.
TEST_F(AgentInTrouble, DoesNotBlameTheJobIfAMissingFileReturnsBeforeTheLastUnitFails) {
  const std::filesystem::path path = std::filesystem::path(testing::TempDir()) / "removed-and-back";
  RemovableFiles files(path);
  NeedsItsFile backend;
  AgentOptions options;
  options.threads = 2;
  Agent agent(options, coordinator_, backend, files, clock_);
  std::jthread runner([&] { ended_ = agent.run(); });
  coordinator_.wait_for([](auto& c) { return c.hellos.size() == 1; });
  coordinator_.tell(assign("l-1", "j-1", {9}));
  backend.begun.acquire();

  std::filesystem::remove(path);
  coordinator_.tell(assign("l-2", "j-1", {1}));
  coordinator_.wait_for([](auto& c) { return c.returned.size() == 1; });
  std::ofstream(path) << "scene";
  backend.fail.release();
  coordinator_.wait_for([](auto& c) { return c.returned.size() + c.failures.size() == 2; });

  agent.drain();
  runner.join();
  std::filesystem::remove(path);
  EXPECT_TRUE(coordinator_.failures.empty());
  EXPECT_EQ(files.acquired, 1) << "no file is fetched for a job without units";
}

// Renders a unit only when the test lets it.
class StepByStep final : public RenderBackend {
 public:
  Digest numeric_class() const override { return fake_->numeric_class(); }
  tl::expected<void, UnitFailure> prepare(const LocalJob& job, const std::atomic<bool>& stop) override {
    return fake_->prepare(job, stop);
  }
  tl::expected<RenderedUnit, UnitFailure> render(const LocalJob& job, const LeaseUnit& unit,
                                                 const std::atomic<bool>& stop) override {
    allowed_.acquire();
    return fake_->render(job, unit, stop);
  }
  void forget(const JobId& job) override { fake_->forget(job); }
  std::uint64_t rss_bytes() const override { return 0; }
  void shutdown() override { allow(1000); }
  void allow(int units) { allowed_.release(units); }

 private:
  std::unique_ptr<LocalBackend> fake_ = make_fake_backend({});
  std::counting_semaphore<> allowed_{0};
};

// Two jobs keep the worker busy without end, and two worlds are all that it keeps in memory.
TEST_F(AgentInTrouble, JobWhoseWorldDoesNotFitGetsItsTurnAlthoughOtherJobsContinue) {
  auto backend = std::make_unique<StepByStep>();
  StepByStep& steps = *backend;
  start_with(std::move(backend));
  TileIndex next = 0;
  const auto feed = [&] {
    for (const char* job : {"j-a", "j-b"})
      coordinator_.tell(assign(fmt::format("l-{}-{}", job, next).c_str(), job, {next % 64}));
    ++next;
  };
  feed();
  coordinator_.tell(assign("l-c", "j-c", {0}));
  for (int i = 0; i < 3; ++i) feed();

  coordinator_.wait_for(
      [](auto& c) {
        return std::any_of(c.results.begin(), c.results.end(),
                           [](const UnitResult& r) { return r.unit.job == JobId{"j-c"}; });
      },
      [&] {
        pass(std::chrono::seconds(1));
        const std::size_t before = coordinator_.results_so_far();
        feed();
        steps.allow(2);
        coordinator_.wait_for([&](auto& c) { return c.results.size() >= before + 2; }, [&] { pass({}); });
      });
}

TEST(Backoff, DoublesUpToItsLimitWithinItsJitterAndStartsAgain) {
  Backoff backoff(std::chrono::milliseconds(100), std::chrono::seconds(1), 42);
  for (const int whole_ms : {100, 200, 400, 800, 1000, 1000}) {
    const Duration pause = backoff.next();
    EXPECT_LE(pause, std::chrono::milliseconds(whole_ms));
    EXPECT_GE(pause, std::chrono::milliseconds(whole_ms) / 2);
  }
  for (int i = 0; i < 100; ++i) EXPECT_LE(backoff.next(), std::chrono::seconds(1));
  backoff.reset();
  EXPECT_LE(backoff.next(), std::chrono::milliseconds(100));
}

}  // namespace
}  // namespace ls::worker
