// Changes and removals of jobs, and damaged folders and records, which must affect one job only.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sqlite3.h>

#include <atomic>
#include <fstream>
#include <functional>
#include <thread>

#include "coordinator/admission/admission.h"
#include "coordinator/base/work_queue.h"
#include "tests/support/fake_clock.h"
#include "tests/unit/service/fake_farm.h"
#include "tests/unit/store/temp_folder.h"

namespace ls::coordinator {
namespace {

using testing::HasSubstr;
namespace fs = std::filesystem;

void sql(const fs::path& data, const std::string& text) {
  sqlite3* db = nullptr;
  ASSERT_EQ(sqlite3_open((data / "jobs.sqlite").c_str(), &db), SQLITE_OK);
  sqlite3_busy_timeout(db, 5000);
  EXPECT_EQ(sqlite3_exec(db, text.c_str(), nullptr, nullptr, nullptr), SQLITE_OK) << sqlite3_errmsg(db);
  sqlite3_close(db);
}

JobId finished(Coordinator& coordinator, JobSpec spec = {}) {
  const JobId job = submit(coordinator, std::move(spec));
  FakeFarm farm(coordinator, 1);
  EXPECT_TRUE(farm.finish(job));
  return job;
}

TEST(Restore, DamagedRecordFailsOnlyItsJobUntilItIsRemoved) {
  TempFolder dir;
  JobId good, bad;
  {
    auto coordinator = open_at(dir.path());
    bad = submit(*coordinator);
    good = submit(*coordinator);
  }
  sql(dir.path(), "UPDATE jobs SET record = 'no JSON' WHERE id = '" + bad.value + "'");

  auto coordinator = open_at(dir.path());

  ASSERT_TRUE(coordinator->job(bad));
  EXPECT_EQ(coordinator->job(bad)->state, JobState::failed);
  EXPECT_THAT(coordinator->job(bad)->error, HasSubstr("damaged"));
  EXPECT_FALSE(coordinator->image_png(bad));
  EXPECT_FALSE(coordinator->tiles(bad));
  EXPECT_FALSE(set_priority(*coordinator, bad, 3));
  ASSERT_TRUE(finish(*coordinator, good));
  EXPECT_EQ(pixels(*coordinator, good), reference_pixels());
  ASSERT_TRUE(coordinator->remove(bad));
  EXPECT_EQ(coordinator->job(bad).error().code, Errc::not_found);
}

TEST(Restore, UnreadableFolderFailsOnlyItsJobUntilItIsRepaired) {
  TempFolder dir;
  JobId good, bad;
  {
    auto coordinator = open_at(dir.path());
    bad = submit(*coordinator);
    good = submit(*coordinator);
    FakeFarm farm(*coordinator, 1);  // a job gets its folder with its first result
    ASSERT_TRUE(farm.run([&] { return coordinator->job(bad)->units_done >= 2; }));
  }
  const fs::path folder = dir.path() / "jobs" / bad.value;
  fs::rename(folder, dir.path() / "aside");
  std::ofstream(folder) << "not a folder";
  {
    auto coordinator = open_at(dir.path());
    EXPECT_EQ(coordinator->job(bad)->state, JobState::failed);
    EXPECT_THAT(coordinator->job(bad)->error, HasSubstr("restart the coordinator"));
    ASSERT_TRUE(finish(*coordinator, good));
  }
  fs::remove(folder);
  fs::rename(dir.path() / "aside", folder);

  auto coordinator = open_at(dir.path());
  ASSERT_TRUE(finish(*coordinator, bad)) << "it goes on as if nothing had been";
  EXPECT_EQ(pixels(*coordinator, bad), reference_pixels());
}

TEST(Pin, JobIsHeldUntilItsClassIsStored) {
  TempFolder dir;
  auto coordinator = open_at(dir.path());
  const JobId job = submit(*coordinator);
  sql(dir.path(),
      "CREATE TRIGGER broken BEFORE UPDATE ON jobs BEGIN SELECT RAISE(ABORT, 'the disk is broken'); END");
  FakeFarm farm(*coordinator, 1);
  // Waits for the refusals of all sent results: one that came after the resume would pause the job again.
  ASSERT_TRUE(farm.run([&] {
    return !farm.refusals.empty() && farm.refusals.size() == static_cast<std::size_t>(farm.results_sent);
  }));

  EXPECT_EQ(coordinator->job(job)->units_done, 0u) << "a restart could pin the job to another class";
  EXPECT_EQ(coordinator->job(job)->state, JobState::paused);
  EXPECT_THAT(coordinator->job(job)->error, HasSubstr("the disk is broken"));
  EXPECT_FALSE(resume(*coordinator, job));

  sql(dir.path(), "DROP TRIGGER broken");
  farm.sessions()[0]->disconnected();
  ASSERT_TRUE(resume(*coordinator, job));
  FakeFarm other(*coordinator, 1);
  ASSERT_TRUE(other.finish(job));
  EXPECT_EQ(pixels(*coordinator, job), reference_pixels());
}

// Makes every change of a job's record fail, as on a full disk, until mend() is called.
void break_records(const fs::path& data) {
  sql(data,
      "CREATE TRIGGER broken BEFORE UPDATE ON jobs BEGIN SELECT RAISE(ABORT, 'the disk is broken'); END");
}
void mend_records(const fs::path& data) { sql(data, "DROP TRIGGER broken"); }

struct UserCommand {
  const char* name;
  JobState before;  // state that the job is brought to before the command
  std::function<Result<void>(Coordinator&, const JobId&)> give;
  JobState after;
};
std::vector<UserCommand> user_commands() {
  using enum JobState;
  return {{"pause", queued, pause, paused},
          {"resume", paused, resume, queued},
          {"cancel", queued,
           [](Coordinator& c, const JobId& job) { return c.change(job, {.state = cancelled}); }, cancelled},
          {"delete", queued, [](Coordinator& c, const JobId& job) { return c.remove(job); }, cancelled},
          {"extend", queued, [](Coordinator& c, const JobId& job) { return extend(c, job, 64); }, queued},
          {"extend a done job", done, [](Coordinator& c, const JobId& job) { return extend(c, job, 64); },
           running}};
}

// The command is acknowledged only if its effect would survive kill -9; a command that is refused has none.
TEST(Change, IsRefusedWithoutEffectIfItCannotBeStored) {
  for (const bool sequence : {false, true})
    for (const UserCommand& command : user_commands()) {
      SCOPED_TRACE(fmt::format("{}{}", command.name, sequence ? ", of a sequence" : ""));
      TempFolder dir;
      auto coordinator = open_at(dir.path());
      JobSpec spec;
      if (sequence) spec.frames = FrameRange{1, 2, 1};
      const JobId job = submit(*coordinator, spec);
      if (command.before == JobState::paused) {
        ASSERT_TRUE(pause(*coordinator, job));
      } else if (command.before == JobState::done) {
        ASSERT_TRUE(finish(*coordinator, job));
      }
      const JobView before = coordinator->job(job).value();
      break_records(dir.path());

      const auto refused = command.give(*coordinator, job);

      ASSERT_FALSE(refused);
      EXPECT_THAT(refused.error().message, HasSubstr("the disk is broken"));
      const JobView now = coordinator->job(job).value();
      EXPECT_EQ(now.state, before.state);
      EXPECT_EQ(now.spp, before.spp);
      EXPECT_EQ(now.units_total, before.units_total);

      mend_records(dir.path());
      coordinator.reset();
      coordinator = open_at(dir.path());
      EXPECT_EQ(coordinator->job(job)->state, before.state) << "after a restart";
      ASSERT_TRUE(command.give(*coordinator, job));
      EXPECT_EQ(coordinator->job(job)->state, command.after);
      coordinator.reset();
      coordinator = open_at(dir.path());
      const JobView after = coordinator->job(job).value();
      EXPECT_EQ(after.state, command.after) << "after a restart";
      EXPECT_EQ(after.spp, std::string_view(command.name).starts_with("extend") ? 64u : before.spp);
    }
}

TEST(Change, CommandsNameTheSceneFileOfAJobThatHasAnotherName) {
  StoredJob job;
  job.id = {"j-1"};
  job.name = "Chapel, take 2";
  job.scene_name = "chapel.xml";
  EXPECT_THAT(replay_of(job), HasSubstr("lightshaft render chapel.xml"));
}

TEST(Change, JobsAndSequencesGetAnotherNameWhichSurvivesARestart) {
  TempFolder dir;
  auto coordinator = open_at(dir.path());
  JobSpec two;
  two.frames = FrameRange{1, 2, 1};
  const JobId job = submit(*coordinator), sequence = submit(*coordinator, two);

  for (const JobId& id : {job, sequence})
    ASSERT_TRUE(coordinator->change(id, {.name = "Chapel, take 2"})) << id.value;

  coordinator.reset();
  coordinator = open_at(dir.path());
  for (const JobId& id : {job, sequence, frame_job(sequence, 2)})
    EXPECT_EQ(coordinator->job(id)->name, "Chapel, take 2") << id.value;
  EXPECT_FALSE(coordinator->change(job, {.name = ""}));
  EXPECT_FALSE(coordinator->change(job, {.name = std::string(257, 'x')}));
  EXPECT_FALSE(coordinator->change(job, {.name = "  "}));
  EXPECT_FALSE(coordinator->change(job, {.name = "a\nb"}));
  EXPECT_FALSE(coordinator->change(frame_job(sequence, 2), {.name = "one frame"}));
}

// The first ray was traced before the pause; the farm and the job in memory count the same seconds.
TEST(Change, FirstResultThatArrivesDuringAPauseStartsTheClockAtTheFirstRay) {
  const auto clock = std::make_shared<FakeClock>();
  Coordinator::Options options;
  options.clock = clock;
  auto coordinator = Coordinator::open(options).value();
  const JobId job = submit(*coordinator);
  FakeFarm farm(*coordinator, 1);
  farm.tamper = [&](UnitResult r) {
    if (farm.results_sent > 0) return std::vector<UnitResult>{};
    clock->advance(std::chrono::seconds(100));
    EXPECT_TRUE(coordinator->change(job, {.state = JobState::paused}));
    clock->advance(std::chrono::seconds(10));
    r.cpu_seconds = 20;
    return std::vector{r};
  };

  ASSERT_TRUE(farm.run([&] { return coordinator->job(job)->units_done == 1; }));

  EXPECT_DOUBLE_EQ(coordinator->job(job)->elapsed_seconds, 10) << "from 20 s before the result to the pause";
  clock->advance(std::chrono::seconds(10));
  ASSERT_TRUE(coordinator->change(job, {.state = JobState::running}));
  clock->advance(std::chrono::seconds(5));
  EXPECT_DOUBLE_EQ(coordinator->job(job)->elapsed_seconds, 15);
}

TEST(Change, FarmsOwnChangesAreStoredOnceTheDiskWorksAgain) {
  TempFolder dir;
  auto coordinator = open_at(dir.path());
  const JobId job = submit(*coordinator);
  break_records(dir.path());
  FakeFarm farm(*coordinator, 1);
  ASSERT_TRUE(farm.work_until_paused(job)) << "its numeric class cannot be stored";
  mend_records(dir.path());

  coordinator->tick();

  coordinator.reset();
  coordinator = open_at(dir.path());
  EXPECT_EQ(coordinator->job(job)->state, JobState::paused);
}

TEST(Done, DoneJobLeavesTheFarmAndCanStillBeExtended) {
  TempFolder dir;
  auto coordinator = open_at(dir.path());
  JobSpec spec;
  spec.spp = 11;
  const JobId job = finished(*coordinator, spec);
  EXPECT_EQ(coordinator->job(job)->units_done, 8u);
  EXPECT_EQ(extend(*coordinator, job, 12).error().code, Errc::invalid_argument);
  ASSERT_TRUE(extend(*coordinator, job, 70));

  // One worker, since with two an idle worker also renders units of the other
  FakeFarm farm(*coordinator, 1);
  ASSERT_TRUE(farm.finish(job));

  EXPECT_EQ(pixels(*coordinator, job), reference_pixels(70));
  EXPECT_EQ(report(*coordinator, job)["core_seconds"], (8 + farm.results_sent) * kUnitSeconds);
}

TEST(Done, ExtendingAJobWithoutItsSnapshotFoldsItsResultsAgain) {
  for (const bool results_too : {false, true}) {
    TempFolder dir;
    JobId job;
    {
      auto coordinator = open_at(dir.path());
      job = finished(*coordinator);
    }
    fs::remove(dir.path() / "jobs" / job.value / "film.snap");
    if (results_too) fs::remove(dir.path() / "jobs" / job.value / "partials-000.seg");
    auto coordinator = open_at(dir.path());
    ASSERT_TRUE(extend(*coordinator, job, 70));
    ASSERT_TRUE(finish(*coordinator, job, 2));
    EXPECT_EQ(pixels(*coordinator, job), reference_pixels(70)) << results_too;
  }
}

TEST(Done, JobWaitsUntilItsSnapshotIsWritten) {
  TempFolder dir;
  auto coordinator = open_at(dir.path());
  const JobId job = submit(*coordinator);
  const fs::path in_the_way = dir.path() / "jobs" / job.value / "film.snap" / "full";
  fs::create_directories(in_the_way);
  FakeFarm farm(*coordinator, 1);
  ASSERT_TRUE(farm.run([&] { return coordinator->job(job)->units_done == 8; }));
  const auto patience = std::chrono::steady_clock::now() + std::chrono::minutes(2);
  while (coordinator->job(job)->error.empty() && std::chrono::steady_clock::now() < patience)
    std::this_thread::yield();

  EXPECT_EQ(coordinator->job(job)->state, JobState::running);
  EXPECT_THAT(coordinator->job(job)->error, HasSubstr("when the job is resumed"));
  fs::remove_all(in_the_way.parent_path());
  ASSERT_TRUE(resume(*coordinator, job));
  ASSERT_TRUE(coordinator->wait(job));
  EXPECT_EQ(pixels(*coordinator, job), reference_pixels());
}

TEST(Remove, CancelsARunningJobAndRemovesAnEndedOne) {
  TempFolder dir;
  auto coordinator = open_at(dir.path());
  const JobId done = finished(*coordinator), running = submit(*coordinator);
  EXPECT_EQ(coordinator->job(done)->state, JobState::done);

  ASSERT_TRUE(coordinator->remove(done));
  EXPECT_EQ(coordinator->job(done).error().code, Errc::not_found);
  ASSERT_TRUE(coordinator->remove(running));
  EXPECT_EQ(coordinator->job(running)->state, JobState::cancelled);
  EXPECT_EQ(coordinator->job(running)->stopped, "user");
  EXPECT_EQ(report(*coordinator, running)["stopped"], "user");
  ASSERT_TRUE(coordinator->remove(running));
  EXPECT_EQ(coordinator->remove(running).error().code, Errc::not_found);
  EXPECT_TRUE(coordinator->jobs().empty());

  // The writer thread works in order, so the end of this job comes after the removals.
  const JobId last = finished(*coordinator);
  EXPECT_FALSE(fs::exists(dir.path() / "jobs" / done.value));
  EXPECT_FALSE(fs::exists(dir.path() / "jobs" / running.value));
  coordinator.reset();
  fs::create_directories(dir.path() / "jobs" / "j-1.removed" / "x");
  coordinator = open_at(dir.path());
  ASSERT_EQ(coordinator->jobs().size(), 1u);
  EXPECT_EQ(coordinator->jobs()[0].id, last);
  EXPECT_FALSE(fs::exists(dir.path() / "jobs" / "j-1.removed")) << "what a crash left of a removal";
}

TEST(Change, IsAtomic) {
  auto coordinator = open_at({});
  const JobId job = submit(*coordinator);
  // Samples and target error cannot be changed together
  EXPECT_FALSE(coordinator->change(job, {JobState::paused, 5, 64, .001}));
  EXPECT_FALSE(coordinator->change(job, {JobState::paused, 5, 4, {}}));  // it has 16 samples already
  EXPECT_FALSE(coordinator->change(job, {JobState::paused, 2'000'000, 64, {}}));

  const JobView before = coordinator->job(job).value();
  EXPECT_EQ(before.priority, 0);
  EXPECT_EQ(before.spp, 16u);
  EXPECT_EQ(before.state, JobState::queued);

  ASSERT_TRUE(coordinator->change(job, {JobState::paused, 5, 64, {}}));
  const JobView after = coordinator->job(job).value();
  EXPECT_EQ(after.priority, 5);
  EXPECT_EQ(after.spp, 64u);
  EXPECT_EQ(after.state, JobState::paused);
}

TEST(Change, TargetSurvivesARestart) {
  TempFolder dir;
  JobId job;
  JobSpec spec;
  spec.target_error = .01;
  {
    auto coordinator = open_at(dir.path());
    job = submit(*coordinator, spec);
    ASSERT_TRUE(coordinator->change(job, {{}, {}, {}, .003}));
  }
  auto coordinator = open_at(dir.path());
  EXPECT_EQ(coordinator->job(job)->target_error, .003);
  ASSERT_TRUE(finish(*coordinator, job));
  EXPECT_LE(report(*coordinator, job)["relmse"].get<double>(), .003);
}

TEST(Lease, LeaseOfAnEarlierStartIsNotConfusedWithACurrentOne) {
  auto coordinator = open_at({});
  submit(*coordinator);
  auto mail = std::make_shared<Mailbox>();
  WorkerHello hello;
  hello.name = "w";
  auto session = coordinator->connect(hello, std::make_shared<MailSink>(mail, 0)).value();
  WorkerProgress progress;
  progress.leases = {{{"l77-1000"}, 0}};
  session->receive(progress);

  std::optional<CancelLease> cancelled;
  while (!cancelled) {
    const auto letter = mail->take();
    ASSERT_TRUE(letter);
    if (const auto* c = std::get_if<CancelLease>(&letter->second)) cancelled = *c;
  }
  EXPECT_EQ(cancelled->lease.value, "l77-1000");
}

TEST(Budget, GrantsInOrderWithoutBlockingThreads) {
  ByteBudget budget(10);
  std::string granted;
  const auto ask = [&](std::size_t bytes, char name) { budget.ask(bytes, [&, name] { granted += name; }); };
  ask(20, 'a');  // granted, since nothing else is in use, although it exceeds the budget
  ask(6, 'b');
  ask(6, 'c');
  ask(1, 'd');  // would fit, but must wait for the earlier requests
  EXPECT_EQ(granted, "a");
  budget.release(20);
  EXPECT_EQ(granted, "ab");
  budget.release(6);
  EXPECT_EQ(granted, "abcd");
  ask(100, 'e');
  budget.close();
  budget.release(7);
  EXPECT_EQ(granted, "abcd");
}

TEST(Queue, BlocksProducersUntilThereIsRoom) {
  WorkQueue<int> queue;
  for (int i = 0; i < 3; ++i) queue.push(i);
  std::atomic<bool> through = false;
  std::jthread producer([&](const std::stop_token& token) { through = queue.wait_for_room(1, token); });
  EXPECT_FALSE(through);
  EXPECT_EQ(queue.pop(2, {}).size(), 2u);
  producer.join();
  EXPECT_TRUE(through);
  queue.push(1);
  std::jthread stopped([&](const std::stop_token& token) { through = queue.wait_for_room(1, token); });
  stopped.request_stop();
  stopped.join();
  EXPECT_FALSE(through);
}

}  // namespace
}  // namespace ls::coordinator
