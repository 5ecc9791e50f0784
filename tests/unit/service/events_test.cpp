#include <gtest/gtest.h>

#include <condition_variable>
#include <mutex>
#include <set>

#include "coordinator/base/limits.h"
#include "coordinator/service/state/publisher.h"
#include "coordinator/views/views.h"
#include "tests/unit/service/fake_farm.h"
#include "tests/unit/store/temp_folder.h"

namespace ls::coordinator {
namespace {

class Listener {
 public:
  std::function<void(const StreamEvent&)> callback() {
    return [this](const StreamEvent& e) {
      const std::lock_guard lock(mutex_);
      events_.push_back(e);
      heard_.notify_all();
    };
  }
  std::vector<StreamEvent> first(std::size_t n) {
    std::unique_lock lock(mutex_);
    EXPECT_TRUE(heard_.wait_for(lock, std::chrono::minutes(2), [&] { return events_.size() >= n; }));
    return events_;
  }
  std::vector<StreamEvent> until_state(const std::string& state) {
    std::unique_lock lock(mutex_);
    const auto seen = [&] {
      return !events_.empty() && events_.back().type == "job" &&
             nlohmann::json::parse(events_.back().data)["state"] == state;
    };
    EXPECT_TRUE(heard_.wait_for(lock, std::chrono::minutes(2), seen));
    return events_;
  }

 private:
  std::mutex mutex_;
  std::condition_variable heard_;
  std::vector<StreamEvent> events_;
};

EventHub::Reserve from_zero() {
  return [](std::uint64_t) -> Result<std::uint64_t> { return 0; };
}

TEST(EventHub, ReplaysMissedEventsAndContinuesLive) {
  EventHub hub(from_zero());
  for (int i = 0; i < 5; ++i) hub.publish("job", std::to_string(i), "j");
  Listener late;

  const auto handle = hub.subscribe(2, late.callback());
  hub.publish("job", "live", "j");

  const auto events = late.first(4);
  ASSERT_EQ(events.size(), 4u);
  for (std::size_t i = 0; i < 4; ++i) EXPECT_EQ(events[i].id, 3 + i);
  EXPECT_EQ(events[3].data, "live");
  EXPECT_EQ(hub.last_id(), 6u);
}

TEST(EventHub, KeepsABoundedHistoryAndStartsWithTheOldestKept) {
  EventHub hub(from_zero());
  for (std::size_t i = 0; i < limits::kEventsKept + 10; ++i) hub.publish("job", "", "");
  Listener reader;
  const auto handle = hub.subscribe(0, reader.callback());
  EXPECT_EQ(reader.first(limits::kEventsKept).front().id, 11u);
}

// A store that counts the reserved ids; it fails while `fails` is set.
struct Ids {
  std::uint64_t reserved = 0;
  bool fails = false;

  EventHub::Reserve reserve() {
    return [this](std::uint64_t count) -> Result<std::uint64_t> {
      if (fails) return fail(Errc::unavailable, "the disk is full");
      reserved += count;
      return reserved - count;
    };
  }
};

void publish(EventHub& hub, std::uint64_t count) {
  for (std::uint64_t i = 0; i < count; ++i) hub.publish("job", "{}", "j");
}

TEST(EventHub, ReservesIdsOnceTheStoreWorks) {
  Ids ids;
  EventHub hub(ids.reserve());
  publish(hub, limits::kEventIdBlock);
  ids.fails = true;
  publish(hub, 2 * limits::kEventIdBlock);
  ids.fails = false;

  publish(hub, limits::kEventIdBlock);

  EXPECT_EQ(hub.last_id(), 4 * limits::kEventIdBlock);
  EXPECT_GE(ids.reserved, hub.last_id());
}

TEST(EventHub, UsesNewIdsOnceTheStoreWorks) {
  Ids ids{.reserved = 5 * limits::kEventIdBlock, .fails = true};
  EventHub hub(ids.reserve());
  publish(hub, limits::kEventIdBlock);
  ids.fails = false;

  publish(hub, 1);

  EXPECT_EQ(hub.last_id(), 5 * limits::kEventIdBlock + 1);
}

TEST(EventHub, SendsNothingAfterTheHandleIsDestroyed) {
  EventHub hub(from_zero());
  Listener gone, stays;
  auto handle = hub.subscribe(0, gone.callback());
  const auto other = hub.subscribe(0, stays.callback());
  hub.publish("job", "1", "");
  stays.first(1);
  gone.first(1);
  handle.reset();
  hub.publish("job", "2", "");
  stays.first(2);
  EXPECT_EQ(gone.first(1).size(), 1u);
}

TEST(Events, CoverAJobFromSubmissionToEndWithGrowingIds) {
  TempFolder dir;
  std::uint64_t last = 0;
  {
    auto coordinator = open_at(dir.path());
    Listener listener;
    const auto handle = coordinator->subscribe(0, listener.callback());
    const JobId job = submit(*coordinator);
    FakeFarm farm(*coordinator, 1);
    ASSERT_TRUE(farm.finish(job));

    const auto events = listener.until_state("done");
    std::set<std::string> tiles;
    for (std::size_t i = 0; i < events.size(); ++i) {
      if (i > 0) {
        EXPECT_EQ(events[i].id, events[i - 1].id + 1);
      }
      const auto data = nlohmann::json::parse(events[i].data);
      if (events[i].type != "worker") {
        EXPECT_EQ(events[i].job, job.value);
      }
      if (events[i].type == "tile") tiles.insert(data["state"]);
    }
    EXPECT_EQ(tiles, (std::set<std::string>{"leased", "folded"}));
    last = coordinator->last_event_id();
  }
  EXPECT_GE(open_at(dir.path())->last_event_id(), last);
}

TEST(Events, IncludeTheRemovalOfAJob) {
  TempFolder dir;
  auto coordinator = open_at(dir.path());
  Listener listener;
  const auto handle = coordinator->subscribe(0, listener.callback());
  const JobId job = submit(*coordinator);
  ASSERT_TRUE(coordinator->remove(job)) << "cancels it";
  listener.until_state("cancelled");

  ASSERT_TRUE(coordinator->remove(job));

  const auto last = listener.until_state("removed").back();
  EXPECT_EQ(last.job, job.value) << "readers of this job's events hear it, too";
  EXPECT_EQ(nlohmann::json::parse(last.data), (nlohmann::json{{"id", job.value}, {"state", "removed"}}));
}

TEST(Views, ShowMissingFiguresAsNullAndCleanBadText) {
  JobView v;
  v.id.value = "j-1";
  v.name = "bad \xff name";
  const auto j = nlohmann::json::parse(job_json(v));
  for (const char* key :
       {"rmse", "rmse_ci95", "relmse", "relmse_ci95", "eta_seconds", "stopped", "error", "target_error",
        "verdict", "slope", "slope_ci95", "efficiency_per_core", "pixels_without_samples"})
    EXPECT_TRUE(j.at(key).is_null()) << key;
  EXPECT_EQ(j["state"], "queued");
  EXPECT_EQ(nlohmann::json::parse(jobs_json(JobsPage{{v, v}}))["jobs"].size(), 2u);
}

TEST(Views, ReportWhetherFiguresAreTrusted) {
  JobView v;
  v.spp = 65536, v.spp_asked = false;
  v.error_now = ErrorFigures{.5, .25, .125, .375, .4, .6};
  v.convergence_status = ConvergenceStatus{ConvergenceStatus::Kind::early, "don't trust yet", false};
  v.trend = Trend{3, 1, .5, 1.5, "as expected"};
  v.efficiency = 2;

  const auto j = nlohmann::json::parse(job_json(v));

  EXPECT_EQ(j["verdict"],
            (nlohmann::json{{"kind", "early"},
                            {"words", "don't trust yet"},
                            {"trusted", false},
                            {"advice",
                             "still noisy: a few bright pixels carry the error; more samples are on "
                             "their way"}}));
  EXPECT_EQ(j["rmse_ci95"], (nlohmann::json{.4, .6}));
  EXPECT_EQ(j["slope"], -1);
  EXPECT_EQ(j["slope_ci95"], (nlohmann::json{-1.5, -.5}));
  EXPECT_EQ(j["efficiency_per_core"], 2);
  EXPECT_TRUE(j["spp_asked"].is_null()) << "its target ends it";
}

TEST(Views, CsvHasOneLineForEachPoint) {
  EXPECT_EQ(convergence_csv({{1.5, 3, 4, {.5, .25, .125, .375, .375, .625}}}),
            "seconds,core_seconds,spp,rmse,relmse,relmse_lo,relmse_hi,true_rmse,true_relmse,true_flip,"
            "rmse_lo,rmse_hi\n"
            "1.5,3,4,0.5,0.25,0.125,0.375,,,,0.375,0.625\n");
  EXPECT_TRUE(convergence_csv({{1.5, 3, 4, {.5, .25, .125, .375}, ReferenceError{2, 4, .5}}})
                  .ends_with(",2,4,0.5,0,0\n"));
  EXPECT_TRUE(convergence_csv({{1.5, 3, 4, {.5, .25, .125, .375}, ReferenceError{2, 4, {}}}})
                  .ends_with(",2,4,,0,0\n"));
}

}  // namespace
}  // namespace ls::coordinator
