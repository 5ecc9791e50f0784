// An agent with real threads, the fake renderer and a scripted coordinator, on a clock that stands still.
#pragma once

#include <gtest/gtest.h>

#include <atomic>
#include <memory>
#include <set>
#include <thread>
#include <vector>

#include "tests/support/fake_clock.h"
#include "tests/unit/agent/scripted_coordinator.h"
#include "worker/agent/agent.h"
#include "worker/fake/fake.h"

namespace ls::worker {

// Fetches blobs from the coordinator and discards their bytes: the fake renderer opens no file.
class FetchedFiles final : public BlobFiles {
 public:
  explicit FetchedFiles(CoordinatorLink& link) : link_(link) {}
  Result<std::shared_ptr<const BlobFile>> acquire(const BlobRef& blob, const std::atomic<bool>&) override {
    struct File final : BlobFile {
      const std::filesystem::path& path() const override { return file; }
      std::filesystem::path file = "/dev/null";
    };
    const auto ok =
        link_.fetch_blob({blob.digest}, [](std::span<const std::byte>) { return Result<void>{}; });
    if (!ok) return tl::unexpected<Error>(ok.error());
    return std::make_shared<const File>();
  }
  std::vector<Digest> held(std::size_t) const override { return {}; }

 private:
  CoordinatorLink& link_;
};

inline RenderSettings settings(std::uint64_t seed) {
  RenderSettings s;
  s.size = {64, 64};
  s.tile = 8;
  s.seed = seed;
  s.integrator = "volpath";
  return s;
}

inline AssignLease assign(const char* lease, const char* job, std::vector<TileIndex> tiles,
                          std::uint64_t seed = 1) {
  const RenderSettings s = settings(seed);
  AssignLease a;
  a.lease = {LeaseId{lease}, JobId{job}, {}};
  for (const TileIndex t : tiles) a.lease.units.push_back({t, 0, TileGrid{s.size, s.tile}.rect(t), {0, 2}});
  a.brief = JobBrief{JobId{job}, sha256(std::string_view("scene")), s, digest_of(s), {}};
  return a;
}

inline std::vector<TileIndex> tiles_up_to(TileIndex n) {
  std::vector<TileIndex> tiles(n);
  for (TileIndex i = 0; i < n; ++i) tiles[i] = i;
  return tiles;
}

inline std::set<TileIndex> tiles_of(const std::vector<UnitResult>& results) {
  std::set<TileIndex> tiles;
  for (const UnitResult& r : results) tiles.insert(r.unit.tile);
  return tiles;
}

class AgentTest : public testing::Test {
 protected:
  void start(AgentOptions options = {}, FakeOptions fake = {}) {
    start_with(make_fake_backend(fake), std::move(options));
  }
  void start_with(std::unique_ptr<RenderBackend> backend, AgentOptions options = {}) {
    coordinator_.add_blob("scene");
    backend_ = std::move(backend);
    options.hello.name = "tester";
    agent_ = std::make_unique<Agent>(options, coordinator_, *backend_, files_, clock_);
    runner_ = std::jthread([this] { ended_ = agent_->run(); });
    coordinator_.wait_for([](auto& c) { return c.hellos.size() == 1; });
  }
  Result<void> drain() {
    agent_->drain();
    return join();
  }
  Result<void> join() {
    runner_.join();
    return ended_;
  }
  void TearDown() override {
    if (!runner_.joinable()) return;
    agent_->stop();
    runner_.join();
  }
  template <class Condition>
  void wait_while_time_passes(Condition condition) {
    coordinator_.wait_for(condition, [this] { pass(std::chrono::milliseconds(100)); });
  }
  void pass(Duration d) {
    clock_.advance(d);
    agent_->wake();
  }

  ScriptedCoordinator coordinator_;
  FakeClock clock_;
  FetchedFiles files_{coordinator_};
  std::unique_ptr<RenderBackend> backend_;
  std::unique_ptr<Agent> agent_;
  Result<void> ended_;
  std::jthread runner_;
};

}  // namespace ls::worker
