// Whole jobs over gRPC in one process: a coordinator in memory, and agents with the fake renderer, each with
// its own connection and cache. Both ends of every stream are in this process, so ThreadSanitizer checks both
// (tests/support/grpc_handover.cpp).
#include <gtest/gtest.h>

#include <atomic>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "coordinator/rpc/rpc_server.h"
#include "tests/unit/service/fake_farm.h"
#include "tests/unit/store/temp_folder.h"
#include "worker/agent/agent.h"
#include "worker/cache/cache.h"
#include "worker/client/client.h"
#include "worker/fake/fake.h"

namespace ls::coordinator {
namespace {

constexpr const char* kToken = "the join token";

class GrpcWorker {
 public:
  GrpcWorker(const std::string& address, const std::string& name, const std::filesystem::path& cache,
             const std::string& token = kToken)
      : link_(worker::make_grpc_link(address, token)) {
    auto files = worker::BlobCache::open(
        cache, 0, [this](const worker::BlobRequest& wanted, const worker::BlobSink& sink) {
          return link_->fetch_blob(wanted, sink);
        });
    EXPECT_TRUE(files) << (files ? "" : files.error().message);
    files_ = std::move(*files);
    worker::AgentOptions options;
    options.hello.name = name;
    options.hello.build = "test";
    options.hello.fake = true;
    options.hello.join_token = token;
    options.threads = 2;
    options.progress_period = std::chrono::milliseconds(5);
    options.backoff_most = std::chrono::milliseconds(200);
    agent_ = std::make_unique<worker::Agent>(std::move(options), *link_, *backend_, *files_, clock_);
    runner_ = std::jthread([this] { ended_ = agent_->run(); });
  }
  ~GrpcWorker() { stop(); }
  void stop() {
    agent_->stop();
    join();
  }
  Result<void> drain() {
    agent_->drain();
    return join();
  }
  Result<void> join() {
    if (runner_.joinable()) runner_.join();
    return ended_;
  }

 private:
  SystemClock clock_;
  std::unique_ptr<worker::CoordinatorLink> link_;
  std::unique_ptr<worker::RenderBackend> backend_ = worker::make_fake_backend({});
  std::unique_ptr<worker::BlobFiles> files_;
  std::unique_ptr<worker::Agent> agent_;
  Result<void> ended_;
  std::jthread runner_;  // last member: its thread uses the others
};

class GrpcFarm : public testing::Test {
 protected:
  GrpcFarm() {
    Coordinator::Options options;
    options.join_token = kToken;
    options.allow_fake = true;
    options.tick = std::chrono::milliseconds(10);
    auto opened = Coordinator::open(std::move(options));
    EXPECT_TRUE(opened) << (opened ? "" : opened.error().message);
    coordinator_ = std::move(*opened);
    start_server("127.0.0.1:0");
  }
  void start_server(const std::string& address) {
    server_ = std::make_unique<GrpcServer>(*coordinator_, join_check(kToken));
    const auto port = server_->start(address);
    ASSERT_TRUE(port) << port.error().message;
    address_ = "127.0.0.1:" + std::to_string(*port);
  }
  std::unique_ptr<GrpcWorker> worker(int number) {
    const std::string name = "worker-" + std::to_string(number);
    return std::make_unique<GrpcWorker>(address_, name, folder_.path() / name);
  }
  // Submits a job of 36 tiles in 6 rounds.
  JobId submit_long(std::uint64_t seed = 1) {
    JobSpec spec;
    spec.size = FrameSize{192, 192};
    spec.spp = 64;
    spec.seed = seed;
    return submit(*coordinator_, spec);
  }
  void wait_for(const std::function<bool()>& condition) {
    while (!condition()) std::this_thread::yield();
  }
  std::uint64_t units_done(const JobId& job) const { return coordinator_->job(job)->units_done; }

  TempFolder folder_;
  std::unique_ptr<Coordinator> coordinator_;
  std::unique_ptr<GrpcServer> server_;
  std::string address_;
};

TEST_F(GrpcFarm, FourWorkersRenderThePixelsOfOne) {
  auto one = worker(0);
  const JobId alone = submit_long();
  ASSERT_TRUE(coordinator_->wait(alone));
  ASSERT_TRUE(one->drain());
  std::vector<std::unique_ptr<GrpcWorker>> workers;
  for (int i = 1; i <= 4; ++i) workers.push_back(worker(i));

  const JobId together = submit_long();
  ASSERT_TRUE(coordinator_->wait(together));

  EXPECT_EQ(pixels(*coordinator_, together), pixels(*coordinator_, alone));
  EXPECT_NE(pixels(*coordinator_, alone), "");
  for (auto& each : workers) EXPECT_TRUE(each->drain());
}

// Leases, results, progress reports and cancellations are sent on the streams at the same time.
TEST_F(GrpcFarm, JobsAreCancelledWhileOthersRender) {
  std::vector<std::unique_ptr<GrpcWorker>> workers;
  for (int i = 0; i < 3; ++i) workers.push_back(worker(i));
  const JobId kept = submit_long();
  for (std::uint64_t seed = 2; seed < 8; ++seed) {
    const JobId cancelled = submit_long(seed);
    wait_for([&] { return units_done(cancelled) > 0 || is_terminal(coordinator_->job(cancelled)->state); });
    static_cast<void>(coordinator_->cancel(cancelled));
  }

  ASSERT_TRUE(coordinator_->wait(kept));

  EXPECT_EQ(coordinator_->job(kept)->state, JobState::done);
}

TEST_F(GrpcFarm, BrokenStreamsLoseNothing) {
  const JobId job = submit_long();
  auto steady = worker(0);
  for (int i = 1; i <= 6; ++i) {  // each worker disconnects without draining first
    const std::uint64_t before = units_done(job);
    auto brief = worker(i);
    wait_for([&] { return units_done(job) > before + 10 || is_terminal(coordinator_->job(job)->state); });
    brief->stop();
  }

  ASSERT_TRUE(coordinator_->wait(job));

  EXPECT_EQ(coordinator_->job(job)->state, JobState::done);
}

TEST_F(GrpcFarm, WorkersRejoinARestartedServer) {
  const JobId job = submit_long();
  auto first = worker(1);
  auto second = worker(2);
  for (int i = 0; i < 3; ++i) {
    const std::uint64_t before = units_done(job);
    wait_for([&] { return units_done(job) > before + 10 || is_terminal(coordinator_->job(job)->state); });
    server_->stop();
    start_server(address_);
  }

  ASSERT_TRUE(coordinator_->wait(job));

  EXPECT_EQ(coordinator_->job(job)->state, JobState::done);
  EXPECT_TRUE(first->drain());
  EXPECT_TRUE(second->drain());
}

TEST_F(GrpcFarm, WorkerWithAWrongTokenEndsWithAnError) {
  GrpcWorker stranger(address_, "stranger", folder_.path() / "stranger", "a guess");

  const auto ended = stranger.join();

  ASSERT_FALSE(ended);
  EXPECT_EQ(ended.error().code, Errc::unauthenticated);
}

// An observer whose lost() returns only after `closed` is set, or after 100 ms.
struct SlowToHear final : worker::LinkObserver {
  void received(ToWorker) override { answered.store(true); }
  void lost(Error) override {
    const auto give_up = std::chrono::steady_clock::now() + std::chrono::milliseconds(100);
    while (!closed.load() && std::chrono::steady_clock::now() < give_up) std::this_thread::yield();
    heard.store(true);
  }
  std::atomic<bool> answered = false, closed = false, heard = false;
};

// close() must wait for lost(). Otherwise the call, which also owns the channel, could outlive the link on a
// thread of gRPC.
TEST_F(GrpcFarm, LinkClosesAfterNotifyingItsObserver) {
  for (int i = 0; i < 5; ++i) {
    auto link = worker::make_grpc_link(address_, kToken);
    const auto observer = std::make_shared<SlowToHear>();
    WorkerHello hello;
    hello.name = "brief";
    hello.join_token = kToken;
    ASSERT_TRUE(link->connect(hello, observer));
    wait_for([&] { return observer->answered.load(); });

    link->close();

    EXPECT_TRUE(observer->heard.load());
    observer->closed.store(true);
    link.reset();
  }
}

// When the last channel of a process is destroyed, gRPC joins its threads. If one of these threads destroyed
// it, that thread would join itself and use freed memory. This test runs no server, since a server's channels
// would keep the threads alive.
TEST(GrpcLink, LinkToAMissingCoordinatorEndsCleanly) {
  for (int i = 0; i < 5; ++i) {
    auto link = worker::make_grpc_link("127.0.0.1:1", kToken);  // a port where no coordinator listens
    const auto observer = std::make_shared<SlowToHear>();
    ASSERT_TRUE(link->connect(WorkerHello{}, observer));

    link->close();

    EXPECT_TRUE(observer->heard.load());
    observer->closed.store(true);
    link.reset();
  }
}

}  // namespace
}  // namespace ls::coordinator
