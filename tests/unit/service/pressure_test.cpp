// If there is no memory for more results, they wait in the streams of their workers.
#include <gtest/gtest.h>

#include <mutex>
#include <thread>

#include "coordinator/base/limits.h"
#include "coordinator/domain/limits.h"
#include "tests/unit/service/fake_farm.h"
#include "tests/unit/service/gate_clock.h"
#include "tests/unit/store/temp_folder.h"

namespace ls::coordinator {
namespace {

TEST(Pressure, ResultsThatWaitForMemoryKeepTheirLeasesAlive) {
  TempFolder dir;
  auto clock = std::make_shared<GateClock>();
  Coordinator::Options options;
  options.data = dir.path();
  options.clock = clock;
  auto coordinator = Coordinator::open(options).value();
  JobSpec large;  // tiles of 32 x 32 pixels: 25 KB each as a message, and as much again decoded
  large.size = {1024, 1024};
  large.spp = 2;
  const JobId job = submit(*coordinator, large);
  struct Sink final : WorkerSink {
    void send(ToWorker message) override {
      const std::lock_guard lock(mutex);
      if (auto* lease = std::get_if<AssignLease>(&message)) leases.push_back(*lease);
    }
    void close() override {}
    std::mutex mutex;
    std::vector<AssignLease> leases;
  };
  const auto sink = std::make_shared<Sink>();
  WorkerHello hello;
  hello.name = "quick";
  hello.build = "test";
  hello.numeric_class = sha256("fake class");
  auto session = coordinator->connect(hello, sink).value();
  FakeFarm farm(*coordinator, 0);
  std::atomic<int> room{0};
  clock->shut(true);

  int sent = 0;
  const AssignLease first = sink->leases.at(0);
  farm.brief(first);
  // Sends the same unit repeatedly; only the size of the results matters here.
  const UnitResult result = farm.render_unit(first.lease, first.lease.units.at(0));
  while (room == sent) {
    ++sent;
    session->receive(UnitResult(result), [&] { ++room; });
  }
  const auto bytes = static_cast<std::size_t>(sent) * 2 * result.exr.size();
  EXPECT_GT(bytes, limits::kMaxResultsWaiting);
  EXPECT_LE(bytes - 2 * result.exr.size(), limits::kMaxResultsWaiting);
  EXPECT_EQ(room, sent - 1) << "its stream is not read on";

  for (Duration waited{}; waited < 2 * kNoGrowthLimit; waited += std::chrono::seconds(5)) {
    clock->advance(std::chrono::seconds(5));
    coordinator->tick();
  }
  EXPECT_EQ(coordinator->figures().units_freed[FreedCause::deadline_passed], 0u);

  clock->shut(false);
  const auto patience = std::chrono::steady_clock::now() + std::chrono::minutes(2);
  while (room < sent && std::chrono::steady_clock::now() < patience) std::this_thread::yield();
  EXPECT_EQ(room, sent);
  EXPECT_EQ(coordinator->job(job)->units_done, 1u);
}

}  // namespace
}  // namespace ls::coordinator
