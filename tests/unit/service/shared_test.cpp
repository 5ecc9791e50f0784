// Jobs taken over from a coordinator that is gone, and jobs that another coordinator has taken over.
#include <gmock/gmock.h>

#include <condition_variable>
#include <fstream>
#include <thread>

#include "coordinator/store/blobs/memory_blobs.h"
#include "tests/support/eventually.h"
#include "tests/support/fake_clock.h"
#include "tests/unit/service/fake_farm.h"
#include "tests/unit/service/moving_store.h"
#include "tests/unit/store/temp_folder.h"

namespace ls::coordinator {

using test::eventually;
namespace {

// A blob store on another machine, which is unavailable while `away` is set.
class FarBlobs final : public MemoryBlobs {
 public:
  std::atomic<bool> away{false};
  std::atomic<int> refused{0};
  Result<bool> find(const Digest& digest) const override {
    if (!away) return has(digest);
    ++const_cast<FarBlobs*>(this)->refused;
    return fail(Errc::unavailable, "S3 does not answer");
  }
};

struct Shared : ::testing::Test {
  TempFolder folder;
  std::shared_ptr<FakeClock> clock = std::make_shared<FakeClock>();
  std::shared_ptr<FarBlobs> blobs = std::make_shared<FarBlobs>();
  std::shared_ptr<MovingStore> store = std::make_shared<MovingStore>();
  std::unique_ptr<Coordinator> coordinator = open();

  std::unique_ptr<Coordinator> open() {
    Coordinator::Options options;
    options.data = folder.path();
    options.jobs = store;
    options.blobs = blobs;
    options.shared = true;
    options.clock = clock;
    options.audit_rate = 0;
    return Coordinator::open(std::move(options)).value();
  }
  // Returns a job as another coordinator would have stored it.
  StoredJob foreign(std::uint64_t spp = 16) {
    JobSpec spec;
    spec.spp = spp;
    const JobId twin = submit(*coordinator, spec);
    StoredJob job = store->jobs().value().back();
    EXPECT_TRUE(coordinator->remove(twin));
    EXPECT_TRUE(coordinator->remove(twin));
    job.id = {"j-inherited"};
    job.state = JobState::running;
    return job;
  }
  void inherit(const StoredJob& job) {
    store->will_tell({.inherited = {{job, "next-door"}}});
    coordinator->tick();
  }
};

TEST_F(Shared, TakeoverWaitsUntilTheBlobStoreResponds) {
  const StoredJob job = foreign();
  blobs->away = true;
  inherit(job);
  ASSERT_TRUE(eventually([&] { return blobs->refused == 1; }));
  coordinator->tick();
  EXPECT_FALSE(coordinator->job(job.id)) << "not failed: it is on its way";

  blobs->away = false;
  // The takeover is postponed because the blob store is unavailable, and repeated later.
  ASSERT_TRUE(eventually([&] {
    clock->advance(std::chrono::seconds(1));
    coordinator->tick();
    return coordinator->job(job.id).has_value();
  }));

  EXPECT_NE(coordinator->job(job.id)->state, JobState::failed) << coordinator->job(job.id)->error;
  ASSERT_TRUE(finish(*coordinator, job.id));
  EXPECT_EQ(pixels(*coordinator, job.id), reference_pixels(16));
}

TEST_F(Shared, MissingFileIsReportedAtOnceAndTheJobWaits) {
  StoredJob job = foreign();
  job.assets.push_back({sha256("fog"), 3, "fog.vol"});
  inherit(job);

  ASSERT_TRUE(eventually([&] { return coordinator->job(job.id).has_value(); }));
  EXPECT_EQ(coordinator->job(job.id)->state, JobState::paused);
  EXPECT_THAT(coordinator->job(job.id)->error, testing::HasSubstr("fog.vol"));

  ASSERT_TRUE(blobs->put(sha256("fog"), std::as_bytes(std::span("fog", 3))));
  EXPECT_TRUE(eventually([&] {
    clock->advance(std::chrono::seconds(1));
    coordinator->tick();
    return coordinator->job(job.id)->state != JobState::paused;
  }));
}

// The image of a job that is taken over is lost, so the figures of that image are dropped.
TEST_F(Shared, InheritedJobDoesNotReportTheErrorOfItsLostImage) {
  StoredJob job = foreign(32);
  job.spec.target_error = 1e-3;
  job.totals.few_hits = 7;
  for (const double spp : {2., 4., 8.})
    ASSERT_TRUE(store->add_point(job.id, {spp, spp, spp, {1, .1 / spp, .05 / spp, .2 / spp}}));

  inherit(job);
  ASSERT_TRUE(eventually([&] { return coordinator->job(job.id).has_value(); }));

  EXPECT_FALSE(coordinator->job(job.id)->error_now);
  EXPECT_FALSE(coordinator->job(job.id)->few_hits);
  EXPECT_FALSE(coordinator->job(job.id)->eta_seconds);
  EXPECT_TRUE(coordinator->convergence(job.id)->empty());
  EXPECT_TRUE(eventually([&] { return store->points(job.id)->empty(); }));
}

// Files of the job here are from an earlier ownership and must be ignored; they may even be of another
// numeric class.
TEST_F(Shared, InheritedJobIgnoresOldLocalFiles) {
  const StoredJob job = foreign(32);
  {
    inherit(job);
    ASSERT_TRUE(eventually([&] { return coordinator->job(job.id).has_value(); }));
    FakeFarm lying(*coordinator, 1);
    lying.lies = [](int, const UnitResult&) { return true; };
    lying.stop_after = 4;
    lying.finish(job.id);
  }
  // Removed as at the first start after the job has gone to another coordinator
  ASSERT_TRUE(store->remove_job(job.id));
  coordinator.reset();
  ASSERT_TRUE(std::filesystem::exists(folder.path() / "jobs" / job.id.value));
  coordinator = open();
  EXPECT_FALSE(std::filesystem::exists(folder.path() / "jobs" / job.id.value)) << "nobody's";

  std::filesystem::create_directories(folder.path() / "jobs" / job.id.value);
  std::ofstream(folder.path() / "jobs" / job.id.value / "film.snap") << "of another time";
  inherit(job);
  ASSERT_TRUE(eventually([&] { return coordinator->job(job.id).has_value(); }));

  EXPECT_FALSE(std::filesystem::exists(folder.path() / "jobs" / job.id.value / "film.snap"));
  EXPECT_EQ(coordinator->job(job.id)->units_done, 0u);
  ASSERT_TRUE(finish(*coordinator, job.id));
  EXPECT_EQ(pixels(*coordinator, job.id), reference_pixels(32));
}

TEST_F(Shared, JobThatChangesCoordinatorIsReportedAsMovedNotCancelled) {
  auto request = SubmitRequest{"test.xml", kSceneText, {}, {}};
  request.owner = "anna";
  const JobId job = coordinator->submit(std::move(request)).value();
  std::mutex mutex;
  std::condition_variable heard;
  std::vector<std::string> states, owners;
  const auto listening = coordinator->subscribe(coordinator->last_event_id(), [&](const StreamEvent& event) {
    if (event.type != "job") return;
    const std::lock_guard lock(mutex);
    states.push_back(nlohmann::json::parse(event.data)["state"]);
    owners.push_back(event.owner);
    heard.notify_all();
  });
  FakeFarm farm(*coordinator, 1);
  farm.stop_after = 1;
  farm.finish(job);

  store->will_tell({.lost = {job}});
  coordinator->tick();

  std::unique_lock lock(mutex);
  ASSERT_TRUE(heard.wait_for(lock, std::chrono::minutes(2),
                             [&] { return !states.empty() && states.back() == "moved"; }));
  EXPECT_THAT(states, testing::Not(testing::Contains("cancelled")));
  EXPECT_EQ(owners.back(), "anna");
  lock.unlock();
  EXPECT_FALSE(coordinator->job(job));
}

}  // namespace
}  // namespace ls::coordinator
