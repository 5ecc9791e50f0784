// The owner of a job (the user of the token that submitted it) is stored, shown, and part of every event of
// the job.
#include <gtest/gtest.h>

#include <mutex>

#include "tests/support/fake_clock.h"
#include "tests/unit/service/fake_farm.h"
#include "tests/unit/store/temp_folder.h"

namespace ls::coordinator {
namespace {

JobId submit_as(Coordinator& coordinator, const std::string& owner, JobSpec spec = {}) {
  if (!spec.spp) spec.spp = 4;
  SubmitRequest request{"test.xml", kSceneText, {}, std::move(spec)};
  request.owner = owner;
  const auto id = coordinator.submit(std::move(request));
  EXPECT_TRUE(id);
  return id.value_or(JobId{});
}

std::string owner_of(const Coordinator& coordinator, const JobId& id) {
  const auto view = coordinator.job(id);
  return view ? view->owner : "(no such job)";
}

TEST(Owner, IsShownAndSurvivesARestart) {
  TempFolder dir;
  JobId annas, nobodys;
  {
    auto coordinator = open_at(dir.path());
    annas = submit_as(*coordinator, "anna");
    nobodys = submit_as(*coordinator, "");
    EXPECT_EQ(owner_of(*coordinator, annas), "anna");
  }
  const auto coordinator = open_at(dir.path());
  EXPECT_EQ(owner_of(*coordinator, annas), "anna");
  EXPECT_EQ(owner_of(*coordinator, nobodys), "");
}

TEST(Owner, SequenceAndFramesHaveOneOwner) {
  TempFolder dir;
  JobSpec spec;
  spec.frames = FrameRange{1, 2, 1};
  JobId id;
  {
    auto coordinator = open_at(dir.path());
    id = submit_as(*coordinator, "anna", spec);
  }
  const auto coordinator = open_at(dir.path());
  EXPECT_EQ(owner_of(*coordinator, id), "anna");
  EXPECT_EQ(owner_of(*coordinator, frame_job(id, 2)), "anna");
  ASSERT_EQ(coordinator->jobs().size(), 1u);
  EXPECT_EQ(coordinator->jobs().front().owner, "anna");
}

TEST(Owner, EveryEventOfAJobHasItsOwner) {
  auto coordinator = open_at({});
  std::mutex mutex;
  std::condition_variable heard;
  std::map<std::string, int> of_job;  // number of events by type
  bool removed = false;
  const auto handle = coordinator->subscribe(0, [&](const StreamEvent& e) {
    const std::lock_guard lock(mutex);
    if (e.type == "worker") return;
    EXPECT_EQ(e.owner, "anna") << e.type << ' ' << e.data;
    ++of_job[e.type];
    removed |= e.data.find("removed") != std::string::npos;
    heard.notify_all();
  });
  const JobId id = submit_as(*coordinator, "anna");
  ASSERT_TRUE(finish(*coordinator, id));
  ASSERT_TRUE(coordinator->remove(id));

  std::unique_lock lock(mutex);
  ASSERT_TRUE(heard.wait_for(lock, std::chrono::minutes(2), [&] { return removed; }));
  EXPECT_GT(of_job["job"], 0);
  EXPECT_GT(of_job["tile"], 0);
}

// The owner in a worker's event is that of the job in the event. A worker may hold units of several users at
// once.
TEST(Owner, WorkersEventBelongsToTheOwnerOfItsJob) {
  Coordinator::Options options;
  const auto clock = std::make_shared<FakeClock>();
  options.clock = clock;
  const auto coordinator = Coordinator::open(std::move(options)).value();
  for (const char* user : {"anna", "bob", "carl"}) submit_as(*coordinator, user);
  std::mutex mutex;
  std::condition_variable heard;
  std::vector<StreamEvent> told;
  const auto handle = coordinator->subscribe(coordinator->last_event_id(), [&](const StreamEvent& e) {
    const std::lock_guard lock(mutex);
    if (e.type == "worker") told.push_back(e);
    heard.notify_all();
  });
  const auto mail = std::make_shared<Mailbox>();
  WorkerHello hello;
  hello.name = "shared";
  hello.numeric_class = sha256("fake class");
  const auto session = coordinator->connect(hello, std::make_shared<MailSink>(mail, 0)).value();
  std::set<JobId> holds;
  while (!mail->empty())
    if (const auto letter = mail->take(); const auto* lease = std::get_if<AssignLease>(&letter->second))
      holds.insert(lease->lease.job);
  ASSERT_GT(holds.size(), 1u);

  clock->advance(std::chrono::seconds(5));
  WorkerProgress progress;
  progress.activity = "loading a secret";
  session->receive(progress);

  std::unique_lock lock(mutex);
  const auto names_a_job = [](const StreamEvent& e) {
    return !nlohmann::json::parse(e.data)["job"].is_null();
  };
  ASSERT_TRUE(heard.wait_for(lock, std::chrono::minutes(2),
                             [&] { return std::any_of(told.begin(), told.end(), names_a_job); }));
  for (const StreamEvent& e : told)
    if (names_a_job(e)) {
      EXPECT_EQ(e.owner, owner_of(*coordinator, {nlohmann::json::parse(e.data)["job"].get<std::string>()}));
    }
}

}  // namespace
}  // namespace ls::coordinator
