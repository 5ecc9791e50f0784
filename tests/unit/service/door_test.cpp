// Which workers and submissions are accepted, and the errors for those that are not.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <thread>

#include "coordinator/admission/admission.h"
#include "coordinator/base/limits.h"
#include "coordinator/service/state/worker_entry.h"
#include "core/image/frame/render_limits.h"
#include "core/scene/schema/integrators.h"
#include "formats/read.h"
#include "tests/unit/service/fake_farm.h"
#include "tests/unit/store/temp_folder.h"
#include "util/protocol/limits.h"

namespace ls::coordinator {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

TEST(Service, OnlyWorkersWithTheJoinTokenMayJoin) {
  Coordinator::Options options;
  options.join_token = "open sesame";
  auto coordinator = Coordinator::open(options).value();
  WorkerHello hello;
  hello.name = "w";
  auto mail = std::make_shared<Mailbox>();
  EXPECT_EQ(coordinator->connect(hello, std::make_shared<MailSink>(mail, 0)).error().code,
            Errc::unauthenticated);
  hello.join_token = "open sesame";
  EXPECT_TRUE(coordinator->connect(hello, std::make_shared<MailSink>(mail, 0)));
  ASSERT_TRUE(std::holds_alternative<Welcome>(mail->take()->second));
}

TEST(Service, FakeWorkerMayJoinOnlyIfAllowed) {
  WorkerHello hello;
  hello.name = "w";
  hello.fake = true;
  auto mail = std::make_shared<Mailbox>();
  const auto real = Coordinator::open({}).value();

  const auto refused = real->connect(hello, std::make_shared<MailSink>(mail, 0));

  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, Errc::failed_precondition);
  EXPECT_NE(refused.error().message.find("--allow-fake"), std::string::npos) << "it says what to do";
  EXPECT_TRUE(real->workers().empty());

  Coordinator::Options options;
  options.allow_fake = true;
  const auto test = Coordinator::open(options).value();
  const auto session = test->connect(hello, std::make_shared<MailSink>(mail, 0));
  ASSERT_TRUE(session);
  EXPECT_TRUE(test->workers().at(0).fake);
}

// A job is marked as fake when a fake worker has rendered one of its units, whatever numeric class the worker
// claims.
TEST(Service, JobIsMarkedFakeOnceAFakeWorkerHasRenderedAUnit) {
  Coordinator::Options options;
  options.allow_fake = true;
  options.audit_rate = 0;
  for (const bool fake : {false, true}) {
    const auto coordinator = Coordinator::open(options).value();
    FakeFarm farm(*coordinator, 1, fake);
    const JobId job = submit(*coordinator);

    ASSERT_TRUE(farm.finish(job));

    EXPECT_EQ(coordinator->job(job)->fake, fake);
    EXPECT_NE(coordinator->report_json(job)->find(fake ? "\"fake\": true" : "\"fake\": false"),
              std::string::npos);
  }
}

TEST(Service, ReconnectedWorkerKeepsItsIdAndItsOldStreamIsIgnored) {
  auto coordinator = open_at({});
  auto mail = std::make_shared<Mailbox>();
  WorkerHello hello;
  hello.name = "w";
  auto first = coordinator->connect(hello, std::make_shared<MailSink>(mail, 0)).value();
  const auto welcome = std::get<Welcome>(mail->take()->second);
  hello.previous_id = welcome.worker;

  auto second = coordinator->connect(hello, std::make_shared<MailSink>(mail, 1)).value();

  const auto again = std::get<Welcome>(mail->take()->second);
  EXPECT_EQ(again.worker, welcome.worker);
  EXPECT_GT(again.epoch, welcome.epoch);
  first->disconnected();
  EXPECT_EQ(coordinator->workers().at(0).state, "connected");
  second->disconnected();
  EXPECT_EQ(coordinator->workers().at(0).state, "lost");
}

// Joins as `hello` says and returns the Welcome.
Welcome join(Coordinator& coordinator, const WorkerHello& hello) {
  const auto mail = std::make_shared<Mailbox>();
  const auto session = coordinator.connect(hello, std::make_shared<MailSink>(mail, 0));
  EXPECT_TRUE(session);
  return std::get<Welcome>(mail->take()->second);
}

// Users see the ids of workers.
TEST(Service, WorkerIdIsNotReusedWithoutItsSecret) {
  const auto coordinator = open_at({});
  WorkerHello hello;
  hello.name = "w";
  hello.secret = "";
  const Welcome first = join(*coordinator, hello);
  EXPECT_EQ(first.secret.size(), 64u);
  EXPECT_EQ(first.secret.find(first.worker.value), std::string::npos);

  WorkerHello thief = hello;
  thief.previous_id = first.worker;
  for (const std::optional<std::string>& guess :
       {std::optional<std::string>(), std::optional<std::string>(""), std::optional<std::string>("guess"),
        std::optional<std::string>(join(*coordinator, hello).secret)}) {
    thief.secret = guess;
    EXPECT_NE(join(*coordinator, thief).worker, first.worker);
  }

  hello.previous_id = first.worker;
  hello.secret = first.secret;
  EXPECT_EQ(join(*coordinator, hello).worker, first.worker);
}

TEST(Service, WorkerWithoutASecretIsIdentifiedByItsIdAlone) {
  const auto coordinator = open_at({});
  WorkerHello old;
  old.name = "w";
  const Welcome first = join(*coordinator, old);
  EXPECT_EQ(first.secret, "");

  old.previous_id = first.worker;

  EXPECT_EQ(join(*coordinator, old).worker, first.worker);
}

TEST(Service, WorkerKeepsItsIdAfterTheCoordinatorRestarts) {
  Coordinator::Options options;
  options.worker_key = "a secret of the farm";
  auto coordinator = Coordinator::open(options).value();
  WorkerHello hello;
  hello.name = "w";
  hello.secret = "";
  const Welcome first = join(*coordinator, hello);
  coordinator = Coordinator::open(options).value();
  hello.previous_id = first.worker;
  hello.secret = first.secret;
  EXPECT_EQ(join(*coordinator, hello).worker, first.worker);

  options.worker_key = "a secret of another farm";
  coordinator = Coordinator::open(options).value();
  EXPECT_NE(join(*coordinator, hello).worker, first.worker);
}

// Anybody with the join token could otherwise write into the log of any job.
TEST(Service, FailureOfAUnitThatTheWorkerDoesNotHoldIsNotLogged) {
  const auto coordinator = open_at({});
  const JobId job = submit(*coordinator);
  WorkerHello hello;
  hello.name = "honest";
  const auto honest_mail = std::make_shared<Mailbox>();
  const auto honest = coordinator->connect(hello, std::make_shared<MailSink>(honest_mail, 0)).value();
  std::optional<AssignLease> lease;
  while (!lease) {
    const auto letter = honest_mail->take();
    ASSERT_TRUE(letter);
    if (const auto* assign = std::get_if<AssignLease>(&letter->second)) lease = *assign;
  }
  hello.name = "stranger";
  hello.numeric_class = sha256("another class");
  const auto mail = std::make_shared<Mailbox>();
  const auto stranger = coordinator->connect(hello, std::make_shared<MailSink>(mail, 1)).value();
  UnitFailure failure;
  failure.unit = {job, lease->lease.units[0].tile, lease->lease.units[0].round};
  failure.lease = lease->lease.id;
  failure.reason = "forged";

  stranger->receive(failure);
  failure.reason = "crashed\n2026-01-01T00:00:00Z cancelled by the administrator\xc2\x9b";
  honest->receive(failure);

  const auto lines = [&](std::string_view text) {
    const std::string log = coordinator->job_log(job).value();
    std::size_t count = 0;
    for (std::size_t at = log.find(text); at != std::string::npos; at = log.find(text, at + 1)) ++count;
    return count;
  };
  while (lines("crashed") == 0) std::this_thread::yield();  // it is written in the background
  EXPECT_EQ(lines("forged"), 0u);
  EXPECT_EQ(lines("crashed 2026-01-01T00:00:00Z cancelled by the administrator "), 1u)
      << coordinator->job_log(job).value();

  const auto log_of = [&](const std::string& name) {
    for (const WorkerView& worker : coordinator->workers())
      if (worker.name == name) return coordinator->worker_log(WorkerId{worker.id}).value();
    return std::string("there is no such worker");
  };
  EXPECT_THAT(log_of("honest"), HasSubstr(" connected: "));
  EXPECT_THAT(log_of("honest"), HasSubstr("crashed 2026-01-01T00:00:00Z cancelled by the administrator "));
  EXPECT_THAT(log_of("stranger"), Not(HasSubstr("forged")));
  EXPECT_EQ(coordinator->worker_log(WorkerId{"w-nobody"}).error().code, Errc::not_found);
}

TEST(WorkerEntry, KeepsItsLatestEventsEachNoLongerThanOneLine) {
  WorkerEntry worker;
  for (std::size_t i = 0; i < 2 * limits::kWorkerLogLines; ++i)
    worker.note(fmt::format("event {}\nforged {}", i, std::string(1'000'000, 'x')));

  ASSERT_EQ(worker.log.size(), limits::kWorkerLogLines);
  EXPECT_THAT(worker.log.front().text, HasSubstr(fmt::format("event {} forged", limits::kWorkerLogLines)));
  for (const LogLine& line : worker.log) EXPECT_LE(line.text.size(), limits::kWorkerLogBytes);
  for (std::size_t letters = limits::kWorkerLogBytes - 4; letters <= limits::kWorkerLogBytes; ++letters) {
    worker.note(std::string(letters, 'x') + "\u00e9\u00e9\u20ac");
    const std::string& kept = worker.log.back().text;
    EXPECT_TRUE(kept.ends_with('x') || kept.ends_with("\u00e9") || kept.ends_with("\u20ac")) << kept;
  }
  const std::string text = log_text(worker.log);
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), limits::kWorkerLogLines);
}

TEST(Service, SceneMayOnlyNameItsOwnFiles) {
  auto coordinator = open_at({});
  std::string text = kSceneText;
  text.replace(text.find("<shape type=\"sphere\"/>"), 22,
               "<shape type=\"ply\"><string name=\"filename\" value=\"/etc/passwd\"/></shape>");
  const auto refused = coordinator->submit({"evil.xml", text, {}, {}});
  ASSERT_FALSE(refused);
  ASSERT_FALSE(refused.error().diagnostics.empty());
  EXPECT_EQ(refused.error().diagnostics[0].place.line, 7);

  const auto missing = coordinator->submit({"a.xml", text, {{"/etc/passwd", sha256("mesh")}}, {}});
  ASSERT_FALSE(missing);
  EXPECT_NE(missing.error().diagnostics.at(0).text.find(sha256("mesh").hex()), std::string::npos);
}

TEST(Service, AcknowledgesFailuresToo) {
  auto coordinator = open_at({});
  const JobId job = submit(*coordinator);
  const auto mail = std::make_shared<Mailbox>();
  WorkerHello hello;
  hello.name = "clumsy";
  const auto session = coordinator->connect(hello, std::make_shared<MailSink>(mail, 0)).value();
  std::optional<AssignLease> lease;
  while (!lease) {
    const auto letter = mail->take();
    ASSERT_TRUE(letter);
    if (const auto* assign = std::get_if<AssignLease>(&letter->second)) lease = *assign;
  }
  const UnitKey unit{job, lease->lease.units[0].tile, lease->lease.units[0].round};
  while (!mail->empty()) mail->take();
  UnitFailure failure;
  failure.unit = unit;
  failure.lease = lease->lease.id;
  failure.reason = "crashed";

  session->receive(failure);

  const auto answer = mail->take();
  ASSERT_TRUE(answer);
  const auto* ack = std::get_if<ResultAck>(&answer->second);
  ASSERT_NE(ack, nullptr) << "before the unit is leased again";
  EXPECT_EQ(ack->unit, unit);
  EXPECT_FALSE(ack->refused);
}

TEST(Service, RefusesASceneWithMoreFilesThanAMessageToAWorkerHolds) {
  auto coordinator = open_at({});
  std::string shapes;
  std::map<std::string, Digest> assets;
  for (std::size_t i = 0; i <= ls::limits::kAssetsPerJob; ++i) {
    const std::string name = std::to_string(i) + ".ply";
    assets[name] = sha256(name);
    ASSERT_TRUE(coordinator->blobs().put(assets[name], std::as_bytes(std::span(name))));
    shapes += "<shape type=\"ply\"><string name=\"filename\" value=\"" + name + "\"/></shape>";
  }
  std::string text = kSceneText;
  text.replace(text.find("<shape type=\"sphere\"/>"), 22, shapes);

  const auto refused = coordinator->submit({"many.xml", text, assets, {}});

  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().error.message.find("4096"), std::string::npos) << refused.error().error.message;
}

TEST(Service, AcceptsEveryIntegratorOfTheSceneFormat) {
  auto coordinator = open_at({});
  for (const auto& row : scene::integrators()) {
    JobSpec spec;
    spec.integrator = std::string(row.name);
    const auto taken = admit({"t.xml", kSceneText, {}, spec}, coordinator->blobs(), scenes_in_this_process());
    ASSERT_TRUE(taken) << row.name << ": " << taken.error().error.message;
    EXPECT_EQ(taken->job.settings.integrator, row.ours);
    EXPECT_EQ(taken->job.settings.max_depth, row.max_depth.value_or(-1)) << row.name;
  }
}

// Scenes and jobs have the same limits. A value above its limit is reported with its place in the scene.
TEST(Service, AcceptsTheLargestAllowedFramesAndSampleCounts) {
  auto coordinator = open_at({});
  const auto with = [&](std::string from, const std::string& to) {
    std::string text = kSceneText;
    text.replace(text.find(from), from.size(), to);
    return admit({"t.xml", text, {}, {}}, coordinator->blobs(), scenes_in_this_process());
  };
  const auto side = [](int n) { return std::to_string(n) + "\""; };
  EXPECT_TRUE(with("40\"", side(kMaxFrameSide)));
  const auto wide = with("40\"", side(kMaxFrameSide + 1));
  ASSERT_FALSE(wide);
  ASSERT_EQ(wide.error().diagnostics.size(), 1u);
  EXPECT_EQ(wide.error().diagnostics[0].place.line, 4);

  EXPECT_TRUE(with("16\"", std::to_string(kMaxSpp) + "\""));
  const auto many = with("16\"", std::to_string(kMaxSpp + 1) + "\"");
  ASSERT_FALSE(many);
  ASSERT_EQ(many.error().diagnostics.size(), 1u);
  EXPECT_EQ(many.error().diagnostics[0].place.line, 5);
}

TEST(Service, RefusesSpecsBeyondItsLimits) {
  auto coordinator = open_at({});
  const auto refusal = [&](JobSpec spec) {
    const auto id = coordinator->submit({"t.xml", kSceneText, {}, std::move(spec)});
    return id ? "" : id.error().error.message;
  };
  JobSpec spec;
  spec.spp = 1'000'000'000;
  EXPECT_NE(refusal(spec), "");
  spec = {};
  spec.size = FrameSize{0, 10};
  EXPECT_NE(refusal(spec).find("'size'"), std::string::npos);
  spec.size = FrameSize{1 << 20, 1 << 20};
  EXPECT_NE(refusal(spec), "");
  spec = {};
  spec.integrator = "radiosity";
  EXPECT_NE(refusal(spec).find("volpath"), std::string::npos);
  spec = {};
  spec.target_error = std::nan("");
  EXPECT_NE(refusal(spec), "");
  EXPECT_TRUE(coordinator->jobs().empty());
}

}  // namespace
}  // namespace ls::coordinator
