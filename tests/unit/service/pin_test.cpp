// A job is pinned to one numeric class: its log never has results of two classes.
#include <gtest/gtest.h>

#include "coordinator/base/limits.h"
#include "tests/support/eventually.h"
#include "tests/unit/service/fake_farm.h"
#include "tests/unit/service/gate_clock.h"
#include "tests/unit/store/temp_folder.h"

namespace ls::coordinator {
namespace {

// Returns a lease of the units of round 0 of `job`, with the brief (scene and settings) that workers get with
// it. `job` is paused and gives no leases, so the brief comes from an equal job.
AssignLease lease_of_round_0(const Coordinator& coordinator, const JobId& job) {
  struct Sink final : WorkerSink {
    void send(ToWorker message) override {
      if (auto* assign = std::get_if<AssignLease>(&message); assign && !lease.brief) lease = *assign;
    }
    void close() override {}
    AssignLease lease;
  };
  auto like_it = open_at({});
  submit(*like_it);
  const auto sink = std::make_shared<Sink>();
  WorkerHello hello;
  hello.numeric_class = sha256("fake class");
  const auto session = like_it->connect(hello, sink).value();
  AssignLease assign = sink->lease;
  assign.lease.job = job;
  assign.lease.units.clear();
  const auto tiles = coordinator.tiles(job);
  for (const TileView& tile : tiles.value()) assign.lease.units.push_back({tile.tile, 0, tile.rect, {0, 2}});
  return assign;
}

TEST(Pin, BatchWithResultsOfTwoClassesStoresOnlyTheFirstClass) {
  const std::string expected = reference_pixels();
  TempFolder dir;
  const auto clock = std::make_shared<GateClock>();
  Coordinator::Options options;
  options.data = dir.path();
  options.clock = clock;
  options.audit_rate = 0;
  auto coordinator = Coordinator::open(options).value();
  const JobId job = submit(*coordinator);
  ASSERT_TRUE(pause(*coordinator, job));  // so that no lease pins the job
  const AssignLease assign = lease_of_round_0(*coordinator, job);
  FakeFarm farm(*coordinator, 0);
  farm.brief(assign);
  const auto acks = std::make_shared<Mailbox>();
  const auto connect = [&](const std::string& name, std::string_view numeric_class) {
    WorkerHello hello;
    hello.name = name;
    hello.numeric_class = sha256(numeric_class);
    return coordinator->connect(hello, std::make_shared<MailSink>(acks, 0)).value();
  };
  const auto first = connect("first", "fake class"), second = connect("second", "other class"),
             bulky = connect("bulky", "fake class");
  // A broken result takes all the memory for results, so the two others wait until it is handled. The thread
  // that handles it then calls `checked`, and so stores neither of the others until both are verified.
  UnitResult broken = farm.render_unit(assign.lease, assign.lease.units[0]);
  broken.exr.assign(limits::kMaxResultsWaiting / 2, std::byte{});
  const int before = clock->reads_of_others();
  const auto checked = [&](int results) {  // the clock is read before and after each verification
    EXPECT_TRUE(test::eventually([&] {
      return clock->reads_of_others() >= before + 2 * (1 + results) &&
             coordinator->figures().arrived_now == static_cast<std::uint64_t>(results);
    }));
  };

  clock->shut(true);
  bulky->receive(std::move(broken), [] {});
  first->receive(farm.render_unit(assign.lease, assign.lease.units[0]), [&] { checked(1); });
  second->receive(farm.render_unit(assign.lease, assign.lease.units[1], "other class"), [&] { checked(2); });
  clock->shut(false);

  std::vector<ToWorker> answers;
  EXPECT_TRUE(test::eventually([&] {
    for (ToWorker& answer : acks->acks()) answers.push_back(std::move(answer));
    return answers.size() == 3;
  }));
  EXPECT_EQ(coordinator->job(job)->units_done, 1u);
  coordinator.reset();
  coordinator = open_at(dir.path());
  ASSERT_EQ(coordinator->job(job)->error, "");
  ASSERT_TRUE(resume(*coordinator, job));
  FakeFarm again(*coordinator, 1);
  ASSERT_TRUE(again.finish(job));
  EXPECT_EQ(pixels(*coordinator, job), expected);
}

}  // namespace
}  // namespace ls::coordinator
