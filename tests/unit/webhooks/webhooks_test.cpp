#include "coordinator/webhooks/webhooks.h"

#include <gtest/gtest.h>

#include <sys/stat.h>

#include <condition_variable>
#include <filesystem>
#include <fstream>
#include <future>
#include <mutex>
#include <nlohmann/json.hpp>

#include "coordinator/base/limits.h"
#include "core/base/digest.h"
#include "core/base/secret.h"
#include "tests/support/eventually.h"
#include "tests/support/span_collector.h"

namespace ls::coordinator {
namespace {

constexpr const char* kScene = R"(<scene version="3.0.0">
  <sensor type="perspective"><film type="hdrfilm"><integer name="width" value="8"/><integer name="height" value="8"/></film></sensor>
  <shape type="sphere"/><emitter type="constant"/></scene>)";

// A receiver that gives the answers set by the test and records the requests.
class Receiver {
 public:
  Result<HttpAnswer> take(const HttpPost& post) {
    const std::lock_guard lock(mutex_);
    posts_.push_back(post);
    came_.notify_all();
    return HttpAnswer{answer, ""};
  }
  std::vector<HttpPost> wait_for(std::size_t count) {
    std::unique_lock lock(mutex_);
    EXPECT_TRUE(came_.wait_for(lock, std::chrono::minutes(2), [&] { return posts_.size() >= count; }));
    return posts_;
  }
  std::atomic<int> answer{200};

 private:
  std::mutex mutex_;
  std::condition_variable came_;
  std::vector<HttpPost> posts_;
};

std::string header(const HttpPost& post, const std::string& name) {
  for (const auto& [key, value] : post.headers)
    if (key == name) return value;
  return "";
}

class WebhooksTest : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::path(::testing::TempDir()) /
              ::testing::UnitTest::GetInstance()->current_test_info()->name();
    std::filesystem::remove_all(folder_);
    open();
  }
  void TearDown() override {
    coordinator_.reset();
    std::filesystem::remove_all(folder_);
  }
  void open() {
    Coordinator::Options options;
    options.data = folder_ / "data";
    auto opened = Coordinator::open(std::move(options));
    ASSERT_TRUE(opened) << opened.error().message;
    coordinator_ = std::move(*opened);
  }
  std::unique_ptr<Webhooks> start(Receiver& receiver) {
    auto started =
        Webhooks::start(*coordinator_, {{"http://receiver/hook"},
                                        "the secret",
                                        folder_ / "outbox",
                                        std::make_shared<SystemClock>(),
                                        [] { return 1700000000.5; },
                                        [&](const HttpPost& post) { return receiver.take(post); }});
    EXPECT_TRUE(started);
    return std::move(*started);
  }
  JobId submit() {
    const auto id = coordinator_->submit({"scene.xml", kScene, {}, {}});
    EXPECT_TRUE(id);
    return *id;
  }
  std::vector<std::string> events(const std::vector<HttpPost>& posts) {
    std::vector<std::string> names;
    for (const auto& post : posts) names.push_back(header(post, "Lightshaft-Event"));
    return names;
  }

  std::filesystem::path folder_;
  std::unique_ptr<Coordinator> coordinator_;
};

using Names = std::vector<std::string>;

TEST_F(WebhooksTest, SendsEachStateOnceInOrderWithTheJob) {
  Receiver receiver;
  const auto webhooks = start(receiver);

  const JobId job = submit();
  ASSERT_TRUE(coordinator_->change(job, {.state = JobState::paused}));
  ASSERT_TRUE(coordinator_->cancel(job));

  const auto posts = receiver.wait_for(3);
  EXPECT_EQ(events(posts), (Names{"job.queued", "job.paused", "job.cancelled"}));
  const auto body = nlohmann::json::parse(posts[2].body);
  EXPECT_EQ(body["event"], "job.cancelled");
  EXPECT_EQ(body["id"], header(posts[2], "Lightshaft-Delivery"));
  EXPECT_EQ(body["job"]["id"], job.value);
  EXPECT_EQ(body["job"]["state"], "cancelled");
}

TEST_F(WebhooksTest, SignsTimeAndBodyWithTheSecret) {
  Receiver receiver;
  const auto webhooks = start(receiver);
  submit();

  const auto post = receiver.wait_for(1)[0];

  EXPECT_EQ(header(post, "Lightshaft-Signature"),
            "t=1700000000,v1=" + hmac_sha256("the secret", "1700000000." + post.body));
}

TEST_F(WebhooksTest, EventOfATracedJobCarriesItsSpan) {
  test::SpanCollector collector;
  const auto tracer = collector.tracer();
  coordinator_.reset();
  Coordinator::Options options;
  options.data = folder_ / "data";
  options.tracer = tracer;
  coordinator_ = std::move(*Coordinator::open(std::move(options)));
  Receiver receiver;
  receiver.answer = 500;
  {
    const auto webhooks =
        Webhooks::start(*coordinator_, {{"http://receiver/hook?key=secret"},
                                        "the secret",
                                        folder_ / "outbox",
                                        std::make_shared<SystemClock>(),
                                        [] { return 1700000000.5; },
                                        [&](const HttpPost& post) { return receiver.take(post); },
                                        tracer});
    const JobId job = submit();
    receiver.wait_for(1);
    EXPECT_TRUE(coordinator_->trace_of(job));
  }
  const auto told = trace::parse_traceparent(header(receiver.wait_for(1)[0], "traceparent"));
  const auto job = coordinator_->trace_of(coordinator_->jobs().front().id);
  ASSERT_TRUE(told && job);
  EXPECT_EQ(told->trace, job->trace);

  ASSERT_TRUE(test::eventually([&] { return !collector.named("deliver webhook").empty(); }));
  const auto span = collector.named("deliver webhook").at(0);
  EXPECT_EQ(span.id, hex(told->span));
  EXPECT_EQ(span.parent, hex(job->span));
  EXPECT_EQ(span.json["status"]["code"], 2);
  EXPECT_EQ(span.json.dump().find("secret"), std::string::npos);
}

// RFC 4231, test case 2.
TEST(WebhookSignature, IsStandardHmac) {
  EXPECT_EQ(hmac_sha256("Jefe", "what do ya want for nothing?"),
            "5bdcc146bf60754e6a042426089575c75a003f089d2739839dec58b964ec3843");
}

TEST_F(WebhooksTest, ResendsUnacceptedEventsWithTheSameId) {
  Receiver receiver;
  receiver.answer = 500;
  const auto webhooks = start(receiver);
  submit();
  receiver.wait_for(1);
  receiver.answer = 200;

  const auto posts = receiver.wait_for(2);

  EXPECT_EQ(posts[0].body, posts[1].body);
  EXPECT_EQ(header(posts[0], "Lightshaft-Delivery"), header(posts[1], "Lightshaft-Delivery"));
}

TEST_F(WebhooksTest, SendsUndeliveredEventsAfterARestart) {
  Receiver away, back;
  away.answer = 503;
  {
    const auto webhooks = start(away);
    submit();
    away.wait_for(1);
  }

  const auto webhooks = start(back);

  EXPECT_EQ(events(back.wait_for(1)), Names{"job.queued"});
}

TEST_F(WebhooksTest, SendsMissedEventsAfterARestart) {
  Receiver before, after;
  JobId job;
  {
    const auto webhooks = start(before);
    job = submit();
    before.wait_for(1);
  }
  ASSERT_TRUE(coordinator_->cancel(job));
  coordinator_.reset();
  open();

  const auto webhooks = start(after);

  EXPECT_EQ(events(after.wait_for(1)), Names{"job.cancelled"});
}

TEST_F(WebhooksTest, DoesNotReportJobsFromBeforeItsStart) {
  const JobId old = submit();
  ASSERT_TRUE(coordinator_->cancel(old));
  Receiver receiver;
  const auto webhooks = start(receiver);

  const JobId fresh = submit();

  const auto posts = receiver.wait_for(1);
  EXPECT_EQ(nlohmann::json::parse(posts[0].body)["job"]["id"], fresh.value);
}

TEST_F(WebhooksTest, RefusesInvalidUrls) {
  for (const char* url :
       {"file:///etc/passwd", "gopher://a", "receiver/hook", "http://a b/", "http://a\r\nX: y"})
    EXPECT_FALSE(check_http_url(url, "--webhook")) << url;
  EXPECT_TRUE(check_http_url("https://receiver.example/hook?x=1", "--webhook"));
}

TEST_F(WebhooksTest, SendsEventsMissedWhileDown) {
  const auto farm = Coordinator::open({}).value();
  const JobId ends = farm->submit({"a.xml", kScene, {}, {}}).value(),
              stays = farm->submit({"b.xml", kScene, {}, {}}).value();
  std::promise<void> held_up, go_on;
  std::atomic<bool> first{true};
  const auto slow = farm->subscribe(farm->last_event_id(), [&](const StreamEvent&) {
    if (!first.exchange(false)) return;
    held_up.set_value();
    go_on.get_future().wait();
  });
  Receiver receiver;
  auto webhooks = Webhooks::start(*farm, {{"http://receiver/hook"},
                                          "the secret",
                                          folder_ / "outbox",
                                          std::make_shared<SystemClock>(),
                                          [] { return 1700000000.5; },
                                          [&](const HttpPost& post) { return receiver.take(post); }});
  ASSERT_TRUE(webhooks);

  ASSERT_TRUE(farm->cancel(ends));
  held_up.get_future().wait();                                     // from now on the callback is blocked
  for (int i = 0; i < static_cast<int>(limits::kEventsKept); ++i)  // so the event of the job's end is lost
    ASSERT_TRUE(farm->change(stays, {.priority = i}));
  go_on.set_value();

  const auto posts = receiver.wait_for(1);
  EXPECT_EQ(events(posts), Names{"job.cancelled"});
  EXPECT_EQ(nlohmann::json::parse(posts[0].body)["job"]["id"], ends.value);
}

TEST_F(WebhooksTest, SecondStartWritesNothingForOpenJobsThatItKnows) {
  const JobId job = submit();
  Receiver receiver;
  start(receiver).reset();
  const auto file = folder_ / "outbox" / "open" / job.value;
  struct stat before {
  }, after{};
  ASSERT_EQ(::stat(file.c_str(), &before), 0);

  start(receiver).reset();

  ASSERT_EQ(::stat(file.c_str(), &after), 0);
  EXPECT_EQ(before.st_ino, after.st_ino) << "written anew";
}

TEST_F(WebhooksTest, PendingEndIsNotSentTwiceAfterACrash) {
  const JobId job = submit();
  const auto open = folder_ / "outbox" / "open" / job.value;
  Receiver receiver;
  receiver.answer = 500;
  {
    const auto webhooks = start(receiver);
    ASSERT_TRUE(coordinator_->cancel(job));
    receiver.wait_for(1);
  }
  std::ofstream(open).close();  // as if the crash had come before this file was removed

  receiver.answer = 200;
  const auto webhooks = start(receiver);
  const JobId next = submit();

  const auto posts = receiver.wait_for(3);
  EXPECT_EQ(events(posts), (Names{"job.cancelled", "job.cancelled", "job.queued"}));
  EXPECT_EQ(header(posts[0], "Lightshaft-Delivery"), header(posts[1], "Lightshaft-Delivery"));
  static_cast<void>(next);
}

}  // namespace
}  // namespace ls::coordinator
