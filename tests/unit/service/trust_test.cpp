// A worker that renders wrong pixels is found and quarantined. None of its results stay in the image, even
// after a restart.
#include <gmock/gmock.h>

#include <algorithm>
#include <atomic>
#include <thread>

#include "coordinator/store/log/audit_file.h"
#include "tests/unit/service/fake_farm.h"
#include "tests/unit/service/moving_store.h"
#include "tests/unit/store/temp_folder.h"

namespace ls::coordinator {
namespace {

std::unique_ptr<Coordinator> open_audited(const std::filesystem::path& data, double rate) {
  Coordinator::Options options;
  options.data = data;
  options.audit_rate = rate;
  auto opened = Coordinator::open(std::move(options));
  EXPECT_TRUE(opened) << (opened ? "" : opened.error().message);
  return std::move(*opened);
}

JobSpec samples(std::uint64_t spp) {
  JobSpec spec;
  spec.spp = spp;
  return spec;
}

// Renders with four workers until the third is found to be faulty, and returns its id.
WorkerId bar_fake_2(Coordinator& coordinator) {
  FakeFarm farm(coordinator, 4);
  farm.lies = [](int worker, const UnitResult&) { return worker == 2; };
  EXPECT_TRUE(farm.run([&] { return coordinator.audits().workers_quarantined > 0; }));
  for (const WorkerView& worker : coordinator.workers())
    if (worker.name == "fake-2") return worker.id;
  ADD_FAILURE() << "fake-2 is not known";
  return {};
}

Result<std::unique_ptr<WorkerSession>> come_back(Coordinator& coordinator, const WorkerId& as) {
  WorkerHello hello;
  hello.name = "fake-2";
  hello.numeric_class = sha256("fake class");
  hello.previous_id = as;
  return coordinator.connect(hello, std::make_shared<MailSink>(std::make_shared<Mailbox>(), 0));
}

TEST(Trust, FarmWithAFaultyWorkerMakesTheImageOfHonestWorkers) {
  auto coordinator = open_audited({}, 1);
  const JobId job = submit(*coordinator, samples(64));
  FakeFarm farm(*coordinator, 4);
  int lies = 0;
  farm.lies = [&](int worker, const UnitResult&) { return worker == 2 && ++lies > 3; };

  ASSERT_TRUE(farm.finish(job));

  EXPECT_EQ(pixels(*coordinator, job), reference_pixels(64));
  EXPECT_GT(lies, 3);
  EXPECT_EQ(coordinator->audits().workers_quarantined, 1u);
  EXPECT_GT(coordinator->audits().tiles_discarded, 0u);
  EXPECT_THAT(coordinator->job_log(job).value(), testing::HasSubstr("both rendered it to"));
  for (const WorkerView& worker : coordinator->workers()) {
    EXPECT_EQ(worker.state, worker.name == "fake-2" ? "sick" : "connected") << worker.name;
    if (worker.name == "fake-2") {
      EXPECT_THAT(worker.activity, testing::HasSubstr("quarantined: it rendered tile"));
      // Under the id of another start it would be trusted again.
      const auto again = coordinator->drain_worker(worker.id, {.restart = true});
      ASSERT_FALSE(again);
      EXPECT_EQ(again.error().code, Errc::failed_precondition);
      EXPECT_THAT(again.error().message, testing::HasSubstr("is quarantined"));
    }
  }
}

TEST(Trust, FaultyWorkersResultsInTheLogAreIgnoredAfterARestart) {
  const TempFolder folder;
  JobId job;
  {
    auto coordinator = open_audited(folder.path(), 1);
    job = submit(*coordinator, samples(512));
    FakeFarm farm(*coordinator, 4);
    farm.lies = [&](int worker, const UnitResult&) { return worker == 2; };
    ASSERT_TRUE(farm.run([&] { return coordinator->audits().workers_quarantined > 0; }));
    farm.stop_after = farm.results_sent + 20;
    farm.finish(job);
    ASSERT_EQ(coordinator->job(job)->state, JobState::running);
  }

  auto coordinator = open_audited(folder.path(), 0);
  ASSERT_TRUE(finish(*coordinator, job, 2));

  EXPECT_EQ(pixels(*coordinator, job), reference_pixels(512));
}

// Waits until the file of audits lists this unit and at least two others; false after 2 minutes. It waits
// because results are verified on several threads, in any order.
bool come_to_be_audited(const std::filesystem::path& job, const UnitKey& unit) {
  const auto patience = std::chrono::steady_clock::now() + std::chrono::minutes(2);
  const auto listed = [&] {
    const auto audits = read_audits(job);
    return audits.size() >= 3 && std::any_of(audits.begin(), audits.end(), [&](const JobRestored::Audit& a) {
             return a.tile == unit.tile && a.round == unit.round;
           });
  };
  while (!listed()) {
    if (std::chrono::steady_clock::now() > patience) return false;
    std::this_thread::yield();
  }
  return true;
}

TEST(Trust, AuditContinuesAfterARestart) {
  const TempFolder folder;
  JobId job;
  {
    auto coordinator = open_audited(folder.path(), 1);
    job = submit(*coordinator, samples(512));
    FakeFarm farm(*coordinator, 3);
    std::optional<UnitKey> lie;
    farm.lies = [&](int worker, const UnitResult& r) {
      if (worker != 0 || lie) return false;
      lie = r.unit;
      return true;
    };
    // Each unit is rendered only once, so no audit ends and the wrong result is not found.
    std::set<UnitKey> seen;
    farm.tamper = [&](UnitResult r) {
      return seen.insert(r.unit).second ? std::vector{r} : std::vector<UnitResult>{};
    };
    ASSERT_TRUE(farm.run([&] { return lie && coordinator->audits().asked >= 3; }));
    ASSERT_EQ(coordinator->audits().workers_quarantined, 0u);
    ASSERT_TRUE(come_to_be_audited(folder.path() / "jobs" / job.value, *lie));
  }

  auto coordinator = open_audited(folder.path(), 0);
  ASSERT_TRUE(finish(*coordinator, job, 3));

  EXPECT_GE(coordinator->audits().equal, 1u);
  EXPECT_EQ(coordinator->audits().workers_quarantined, 1u) << "one result was wrong";
  EXPECT_EQ(pixels(*coordinator, job), reference_pixels(512));
}

TEST(Trust, WorkerStaysQuarantinedAfterARestart) {
  const TempFolder folder;
  WorkerId faulty;
  {
    auto coordinator = open_audited(folder.path(), 1);
    submit(*coordinator, samples(512));
    faulty = bar_fake_2(*coordinator);
  }

  auto coordinator = open_audited(folder.path(), 1);
  const auto session = come_back(*coordinator, faulty);

  ASSERT_TRUE(session);
  ASSERT_EQ(coordinator->workers().size(), 1u);
  EXPECT_EQ(coordinator->workers()[0].id, faulty);
  EXPECT_EQ(coordinator->workers()[0].state, "sick");
  EXPECT_THAT(coordinator->workers()[0].activity, testing::StartsWith("quarantined: it rendered tile"));
}

TEST(Trust, WorkerStaysQuarantinedAfterTheJobThatExposedItIsRemoved) {
  const TempFolder folder;
  WorkerId faulty;
  {
    auto coordinator = open_audited(folder.path(), 1);
    const JobId job = submit(*coordinator, samples(512));
    faulty = bar_fake_2(*coordinator);
    ASSERT_TRUE(coordinator->remove(job)) << "cancelled";
    ASSERT_TRUE(coordinator->remove(job)) << "gone";
  }

  auto coordinator = open_audited(folder.path(), 1);
  ASSERT_TRUE(coordinator->jobs().empty());
  const auto session = come_back(*coordinator, faulty);

  ASSERT_TRUE(session);
  EXPECT_EQ(coordinator->workers()[0].id, faulty);
  EXPECT_EQ(coordinator->workers()[0].state, "sick");
}

struct FoundElsewhere : ::testing::Test {
  TempFolder folder;
  std::shared_ptr<MovingStore> store;

  std::unique_ptr<Coordinator> open(bool on_disk = true) {
    store = std::make_shared<MovingStore>(
        on_disk ? std::shared_ptr<JobStore>(open_sqlite_job_store(folder.path() / "own.sqlite").value())
                : std::shared_ptr<JobStore>(make_memory_job_store()));
    Coordinator::Options options;
    if (on_disk) options.data = folder.path();
    options.jobs = store;
    options.shared = true;
    options.audit_rate = 0;
    return Coordinator::open(std::move(options)).value();
  }
  // Opens a coordinator in memory that audits every result.
  std::unique_ptr<Coordinator> open_audited_here() {
    store = std::make_shared<MovingStore>();
    Coordinator::Options options;
    options.jobs = store;
    options.audit_rate = 1;
    return Coordinator::open(std::move(options)).value();
  }
};

TEST_F(FoundElsewhere, WorkerIsQuarantinedHereTooAndItsTilesAreRenderedAgain) {
  auto coordinator = open();
  const JobId job = submit(*coordinator, samples(64));
  FakeFarm farm(*coordinator, 2);
  farm.lies = [&](int worker, const UnitResult&) { return worker == 1; };
  ASSERT_TRUE(farm.run([&] { return farm.results_sent >= 6; }));
  const WorkerId faulty = coordinator->workers()[1].id;
  store->will_tell({.quarantined = {{faulty, "it lied to the coordinator next door"}}});

  coordinator->tick();

  EXPECT_EQ(coordinator->workers()[1].state, "sick");
  EXPECT_EQ(coordinator->workers()[1].activity, "quarantined: it lied to the coordinator next door");
  ASSERT_TRUE(farm.finish(job));
  EXPECT_EQ(pixels(*coordinator, job), reference_pixels(64));
}

// The finished image keeps the wrong pixels, but an extension of it uses none of them.
TEST_F(FoundElsewhere, FinishedJobIsExtendedWithoutTheFaultyWorkersPixels) {
  for (const bool on_disk : {true, false}) {
    auto coordinator = open(on_disk);
    const JobId job = submit(*coordinator, samples(16));
    {
      FakeFarm lying(*coordinator, 1);
      lying.lies = [](int, const UnitResult&) { return true; };
      ASSERT_TRUE(lying.finish(job));
      ASSERT_NE(pixels(*coordinator, job), reference_pixels(16));
      store->will_tell({.quarantined = {{coordinator->workers()[0].id, "it lied elsewhere"}}});
      coordinator->tick();
    }
    ASSERT_TRUE(extend(*coordinator, job, 64));
    FakeFarm honest(*coordinator, 1);
    if (on_disk) {  // also with a restart in the middle
      honest.stop_after = 3;
      honest.finish(job);
      coordinator.reset();
      coordinator = open();
      FakeFarm more(*coordinator, 1);
      ASSERT_TRUE(more.finish(job));
    } else {
      ASSERT_TRUE(honest.finish(job));
    }
    EXPECT_EQ(pixels(*coordinator, job), reference_pixels(64)) << on_disk;
  }
}

TEST_F(FoundElsewhere, JobsWaitUntilTheQuarantineIsStored) {
  auto coordinator = open_audited_here();
  const JobId job = submit(*coordinator, samples(64));
  FakeFarm farm(*coordinator, 4);
  farm.ticks = true;
  farm.lies = [&](int worker, const UnitResult&) { return worker == 2; };
  store->refuses_to_bar = true;

  ASSERT_TRUE(farm.run([&] { return coordinator->audits().workers_quarantined > 0; }));

  EXPECT_EQ(coordinator->job(job)->state, JobState::paused);
  EXPECT_THAT(coordinator->job(job)->error, testing::HasSubstr("the disk is full"));
  EXPECT_FALSE(resume(*coordinator, job));
  store->refuses_to_bar = false;
  ASSERT_TRUE(resume(*coordinator, job));
  ASSERT_TRUE(farm.finish(job));
  EXPECT_EQ(pixels(*coordinator, job), reference_pixels(64));
  EXPECT_EQ(store->quarantined().value().size(), 1u);
}

// The user resumes the job while a result is being stored. Storing it has failed already, but the error is
// handled only after the resume. The test is repeated, since the scheduler decides whether the resume falls
// between the two.
TEST_F(FoundElsewhere, OldErrorDoesNotPauseAResumedJobAgain) {
  for (int trial = 0; trial < 40; ++trial) {
    auto coordinator = open_audited_here();
    const JobId job = submit(*coordinator, samples(64));
    std::atomic<int> refusals = 0;
    store->on_refusal = [&] {
      if (++refusals == 1) refusals.notify_all();
    };
    store->refuses_to_bar = true;
    std::jthread user([&] {
      refusals.wait(0);
      // Waits for the second refusal, which is of a result, if one is still being stored
      for (int i = 0; i < 100000 && refusals < 2; ++i) std::this_thread::yield();
      store->refuses_to_bar = false;
      EXPECT_TRUE(resume(*coordinator, job));
    });
    FakeFarm farm(*coordinator, 4);
    farm.ticks = true;
    farm.lies = [&](int worker, const UnitResult&) { return worker == 2; };

    ASSERT_TRUE(farm.finish(job)) << "trial " << trial;

    EXPECT_EQ(pixels(*coordinator, job), reference_pixels(64));
  }
}

TEST(Trust, AbsurdTimesFromAWorkerAreIgnoredAndTheRecordStaysReadable) {
  const TempFolder folder;
  JobId job;
  {
    auto coordinator = open_audited(folder.path(), 0);
    job = submit(*coordinator, samples(16));
    FakeFarm farm(*coordinator, 1);
    farm.tamper = [](UnitResult r) {
      r.cpu_seconds = 1.7e308;
      r.times.load = 1.7e308;
      return std::vector{std::move(r)};
    };
    ASSERT_TRUE(farm.finish(job));
    EXPECT_EQ(coordinator->job(job)->core_seconds, 0);
  }

  auto coordinator = open_audited(folder.path(), 0);

  EXPECT_EQ(coordinator->job(job)->state, JobState::done) << coordinator->job(job)->error;
  EXPECT_TRUE(coordinator->image_exr(job));
}

TEST(Trust, JobTooLargeForAllWorkersSaysSo) {
  auto coordinator = open_audited({}, 0);
  JobSpec spec = samples(4);
  spec.memory = 8ull << 30;
  spec.max_workers = 3;
  const JobId job = submit(*coordinator, spec);
  WorkerHello hello;
  hello.name = "small";
  hello.numeric_class = sha256("fake class");
  hello.memory_bytes = 2ull << 30;
  const auto session =
      coordinator->connect(hello, std::make_shared<MailSink>(std::make_shared<Mailbox>(), 0));

  const JobView view = coordinator->job(job).value();

  EXPECT_EQ(view.error, "small has 2.0 GiB of memory and the job needs at least 8.0 GiB");
  EXPECT_EQ(view.memory_bytes, 8ull << 30);
  EXPECT_EQ(view.max_workers, 3u);
  EXPECT_EQ(coordinator->workers()[0].memory_bytes, 2ull << 30);
}

}  // namespace
}  // namespace ls::coordinator
