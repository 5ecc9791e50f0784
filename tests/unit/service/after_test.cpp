// Jobs that wait for other jobs: when they begin, what is said of them, and what ends their wait.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <condition_variable>
#include <map>
#include <mutex>

#include "tests/unit/service/fake_farm.h"
#include "tests/unit/service/moving_store.h"
#include "tests/unit/store/temp_folder.h"

namespace ls::coordinator {
namespace {

using testing::HasSubstr;

JobSpec after(const std::vector<JobId>& jobs, const std::string& frames = "") {
  JobSpec spec;
  for (const JobId& job : jobs) spec.after.push_back(job.value);
  if (!frames.empty()) spec.frames = parse_frames(frames).value();
  return spec;
}
JobSpec frames(const std::string& range) { return after({}, range); }

std::vector<std::string> waits(const Coordinator& coordinator, const JobId& job) {
  std::vector<std::string> ids;
  const auto view = coordinator.job(job);
  for (const AfterView& one : view->after) ids.push_back(one.id.value);
  return ids;
}

Result<void> set_after(Coordinator& coordinator, const JobId& job, const std::vector<JobId>& jobs) {
  JobChange change;
  change.after = after(jobs).after;
  return coordinator.change(job, change);
}

std::string refusal(Coordinator& coordinator, JobSpec spec) {
  SubmitRequest request;
  request.scene_name = "scene.xml";
  request.scene_text = kSceneText;
  request.spec = std::move(spec);
  const auto taken = coordinator.submit(request);
  return taken ? "" : taken.error().error.message;
}

// Counts the events of each job.
class Events {
 public:
  explicit Events(Coordinator& coordinator)
      : coordinator_(coordinator),
        last_(coordinator.last_event_id()),
        listening_(coordinator.subscribe(last_, [this](const StreamEvent& e) {
          const std::lock_guard lock(mutex_);
          if (e.type == "job") ++of_[e.job];
          last_ = e.id;
          heard_.notify_all();
        })) {}
  // The number of events of the frames 1 to `frames` of this sequence that were published so far
  int of_frames(const JobId& sequence, std::uint32_t frames) {
    std::unique_lock lock(mutex_);
    EXPECT_TRUE(heard_.wait_for(lock, std::chrono::minutes(1),
                                [&, until = coordinator_.last_event_id()] { return last_ >= until; }));
    int sum = 0;
    for (std::uint32_t frame = 1; frame <= frames; ++frame) sum += of_[frame_job(sequence, frame).value];
    return sum;
  }

 private:
  Coordinator& coordinator_;
  std::mutex mutex_;
  std::condition_variable heard_;
  std::map<std::string, int> of_;
  std::uint64_t last_;  // id of the latest event heard
  std::shared_ptr<void> listening_;
};

// A store that takes no records while `full` is set.
struct FullStore final : MovingStore {
  Result<void> put_jobs(std::span<const StoredJob> jobs) override {
    return full ? fail(Errc::unavailable, "the disk is full") : MovingStore::put_jobs(jobs);
  }
  std::atomic<bool> full{false};
};

TEST(After, JobBeginsWhenItsPrerequisiteIsDone) {
  TempFolder dir;
  auto coordinator = open_at(dir.path());
  const JobId first = submit(*coordinator), second = submit(*coordinator, after({first}));
  EXPECT_EQ(coordinator->job(second)->state, JobState::queued);
  EXPECT_EQ(waits(*coordinator, second), std::vector{first.value});
  EXPECT_EQ(coordinator->job(second)->waits_for, "waits for job " + first.value + ", which is queued");
  EXPECT_EQ(coordinator->job(second)->error, "");

  FakeFarm farm(*coordinator, 2);
  ASSERT_TRUE(farm.run([&] {
    EXPECT_TRUE(coordinator->job(second)->units_done == 0 ||
                coordinator->job(first)->state == JobState::done);
    return coordinator->job(second)->state == JobState::done;
  }));

  EXPECT_EQ(waits(*coordinator, second), std::vector<std::string>());
}

TEST(After, JobWaitsForAllOfItsPrerequisites) {
  auto coordinator = open_at({});
  const JobId one = submit(*coordinator), two = submit(*coordinator);
  const JobId last = submit(*coordinator, after({two, one}));
  FakeFarm farm(*coordinator, 1);
  ASSERT_TRUE(farm.run([&] { return coordinator->job(one)->state == JobState::done; }));

  EXPECT_EQ(coordinator->job(last)->units_done, 0u);
  ASSERT_TRUE(farm.run([&] { return coordinator->job(last)->state == JobState::done; }));
  EXPECT_EQ(coordinator->job(two)->state, JobState::done);
}

TEST(After, FrameWaitsForTheFrameWithItsNumberInASequenceOfEqualFrames) {
  auto coordinator = open_at({});
  const JobId first = submit(*coordinator, frames("1-3"));
  const JobId same = submit(*coordinator, after({first}, "1-3"));
  const JobId other = submit(*coordinator, after({first}, "2-3"));

  EXPECT_EQ(waits(*coordinator, frame_job(same, 2)), std::vector{frame_job(first, 2).value});
  EXPECT_EQ(waits(*coordinator, frame_job(other, 2)), std::vector{first.value});
  EXPECT_THAT(coordinator->job(same)->waits_for, HasSubstr("frame 1 waits for job " + first.value));

  FakeFarm farm(*coordinator, 1);
  ASSERT_TRUE(farm.run([&] { return coordinator->job(frame_job(first, 1))->state == JobState::done; }));
  EXPECT_EQ(waits(*coordinator, frame_job(same, 1)), std::vector<std::string>());
  EXPECT_EQ(waits(*coordinator, frame_job(other, 2)), std::vector{first.value});
  ASSERT_TRUE(farm.run([&] { return coordinator->job(other)->state == JobState::done; }));
  EXPECT_EQ(coordinator->job(first)->state, JobState::done);
}

TEST(After, UnknownAndCancelledJobsAreRefused) {
  auto coordinator = open_at({});
  EXPECT_EQ(refusal(*coordinator, after({{"j-none"}})), "after: there is no job j-none");
  const JobId cancelled = submit(*coordinator);
  ASSERT_TRUE(coordinator->remove(cancelled));

  EXPECT_EQ(refusal(*coordinator, after({cancelled})),
            "after: job " + cancelled.value +
                " is cancelled and will never be done: submit it again, and name the new job here");
}

TEST(After, DoneJobIsNotWaitedFor) {
  auto coordinator = open_at({});
  const JobId first = submit(*coordinator);
  FakeFarm farm(*coordinator, 1);
  ASSERT_TRUE(farm.finish(first));

  EXPECT_EQ(waits(*coordinator, submit(*coordinator, after({first}))), std::vector<std::string>());
}

TEST(After, CancelledJobKeepsItsWaitersHeldWithAnErrorThatSaysWhatToDo) {
  auto coordinator = open_at({});
  const JobId first = submit(*coordinator), second = submit(*coordinator, after({first}));
  ASSERT_TRUE(coordinator->remove(first));
  const std::string advice = ": name another one (lightshaft after " + second.value +
                             " JOB), let it go without (lightshaft after " + second.value + "), or cancel it";
  EXPECT_EQ(coordinator->job(second)->state, JobState::queued);
  EXPECT_EQ(coordinator->job(second)->error,
            "job " + first.value + ", for which it waits, was cancelled" + advice);
  ASSERT_TRUE(coordinator->remove(first));
  EXPECT_EQ(coordinator->job(second)->error,
            "job " + first.value + ", for which it waits, is not here any more" + advice);

  ASSERT_TRUE(set_after(*coordinator, second, {}));

  EXPECT_EQ(coordinator->job(second)->error, "no worker is connected");
  FakeFarm farm(*coordinator, 1);
  EXPECT_TRUE(farm.finish(second));
  EXPECT_EQ(coordinator->job(second)->state, JobState::done);
}

TEST(After, WaitingForItselfIsRefused) {
  auto coordinator = open_at({});
  const JobId one = submit(*coordinator), two = submit(*coordinator, after({one}));
  const JobId three = submit(*coordinator, after({two}, "1-2"));

  for (const JobId& last : {one, two, three, frame_job(three, 2)}) {
    const auto refused = set_after(*coordinator, one, {last});
    ASSERT_FALSE(refused) << last.value;
    EXPECT_THAT(refused.error().message, HasSubstr("would wait for itself"));
  }
  EXPECT_EQ(waits(*coordinator, one), std::vector<std::string>());
}

TEST(After, RestartKeepsWaitingJobsAndFindsPrerequisitesThatAreDone) {
  TempFolder dir;
  JobId first, second, third;
  {
    auto coordinator = open_at(dir.path());
    first = submit(*coordinator);
    second = submit(*coordinator, after({first}));
    third = submit(*coordinator, after({second}));
    FakeFarm farm(*coordinator, 1);
    ASSERT_TRUE(farm.finish(first));
  }

  auto coordinator = open_at(dir.path());

  EXPECT_EQ(waits(*coordinator, second), std::vector<std::string>());
  EXPECT_EQ(waits(*coordinator, third), std::vector{second.value});
  FakeFarm farm(*coordinator, 1);
  ASSERT_TRUE(farm.run([&] {
    EXPECT_TRUE(coordinator->job(third)->units_done == 0 ||
                coordinator->job(second)->state == JobState::done);
    return coordinator->job(third)->state == JobState::done;
  }));
}

TEST(After, FramesThatWaitForASequenceAreNotifiedOnceOfEachEnd) {
  auto coordinator = open_at({});
  const JobId first = submit(*coordinator, frames("1-6"));
  const JobId second = submit(*coordinator, after({first}, "1-5"));
  Events events(*coordinator);

  ASSERT_TRUE(coordinator->remove(first));
  EXPECT_EQ(events.of_frames(second, 5), 5);
  EXPECT_THAT(coordinator->job(second)->waits_for, HasSubstr("was cancelled"));

  ASSERT_TRUE(coordinator->remove(first));
  EXPECT_EQ(events.of_frames(second, 5), 10);
  EXPECT_THAT(coordinator->job(second)->waits_for, HasSubstr("is not here any more"));
}

TEST(After, FramesThatWaitForASequenceIgnoreTheEndsOfItsFrames) {
  auto coordinator = open_at({});
  const JobId first = submit(*coordinator, frames("1-6"));
  const JobId second = submit(*coordinator, after({first}, "1-5"));
  Events events(*coordinator);
  FakeFarm farm(*coordinator, 1);
  farm.tamper = [&](UnitResult r) {
    return r.unit.job == frame_job(first, 6) ? std::vector<UnitResult>() : std::vector{std::move(r)};
  };

  ASSERT_TRUE(farm.run([&] { return coordinator->job(first)->frames->done == 5; }));
  EXPECT_EQ(events.of_frames(second, 5), 0);
}

TEST(After, ExtendedSequenceReleasesLaterWaitersWhenItIsDoneAgain) {
  auto coordinator = open_at({});
  const JobId first = submit(*coordinator, frames("1-2"));
  FakeFarm farm(*coordinator, 1);
  ASSERT_TRUE(farm.run([&] { return coordinator->job(first)->state == JobState::done; }));
  ASSERT_TRUE(extend(*coordinator, first, 64));
  const JobId second = submit(*coordinator, after({first}));
  EXPECT_EQ(waits(*coordinator, second), std::vector{first.value});

  ASSERT_TRUE(farm.run([&] { return coordinator->job(second)->state == JobState::done; }));
}

TEST(After, JobNamedTwiceIsWaitedForOnce) {
  auto coordinator = open_at({});
  const JobId first = submit(*coordinator);

  EXPECT_EQ(waits(*coordinator, submit(*coordinator, after({first, first}))), std::vector{first.value});
}

TEST(After, StartedJobIsNoLongerHeld) {
  auto coordinator = open_at({});
  const JobId begun = submit(*coordinator), shot = submit(*coordinator, frames("1-2"));
  const JobId other = submit(*coordinator);
  FakeFarm farm(*coordinator, 1);
  farm.tamper = [&](UnitResult r) {
    return farm.results_sent == 0 ? std::vector{std::move(r)} : std::vector<UnitResult>();
  };
  ASSERT_TRUE(farm.run([&] { return coordinator->job(begun)->units_done > 0; }));

  const auto refused = set_after(*coordinator, begun, {other});
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().message,
            "job " + begun.value +
                " has begun: it can no longer wait for others; pause it instead, and resume it when they are "
                "done");
  EXPECT_TRUE(set_after(*coordinator, begun, {}));
  ASSERT_TRUE(pause(*coordinator, begun));
  EXPECT_FALSE(set_after(*coordinator, begun, {other}));

  ASSERT_TRUE(pause(*coordinator, frame_job(shot, 2)));
  FakeFarm more(*coordinator, 1);
  ASSERT_TRUE(more.run([&] { return coordinator->job(frame_job(shot, 1))->state == JobState::running; }));
  ASSERT_TRUE(set_after(*coordinator, shot, {other}));
  EXPECT_EQ(waits(*coordinator, frame_job(shot, 1)), std::vector<std::string>());
  EXPECT_EQ(waits(*coordinator, frame_job(shot, 2)), std::vector{other.value});
}

TEST(After, RefusedWaitUndoesTheWholeChange) {
  auto coordinator = open_at({});
  for (const JobId& job : {submit(*coordinator), submit(*coordinator, frames("1-2"))}) {
    JobChange change{.priority = 5, .spp = 64};
    change.after = {job.value};
    const std::uint64_t before = coordinator->job(job)->spp;

    EXPECT_FALSE(coordinator->change(job, change));

    EXPECT_EQ(coordinator->job(job)->priority, 0);
    EXPECT_EQ(coordinator->job(job)->spp, before);
  }
}

TEST(After, WaitThatCannotBeStoredIsRefusedWithoutEffect) {
  const auto store = std::make_shared<FullStore>();
  const auto coordinator = std::move(*Coordinator::open({.jobs = store}));
  const JobId first = submit(*coordinator), second = submit(*coordinator, after({first}));
  store->full = true;

  EXPECT_FALSE(set_after(*coordinator, second, {}));

  EXPECT_EQ(waits(*coordinator, second), std::vector{first.value});
  store->full = false;
  EXPECT_TRUE(set_after(*coordinator, second, {}));
  EXPECT_EQ(waits(*coordinator, second), std::vector<std::string>());
}

TEST(After, ResubmittedJobWaitsForNobody) {
  auto coordinator = open_at({});
  const JobId first = submit(*coordinator), second = submit(*coordinator, after({first}));

  const auto again = coordinator->submit_again(second, {}, "");

  ASSERT_TRUE(again);
  EXPECT_EQ(waits(*coordinator, *again), std::vector<std::string>());
}

}  // namespace
}  // namespace ls::coordinator
