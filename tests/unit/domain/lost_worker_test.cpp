// Which workers that have left are remembered, and whose failures are news.
#include "tests/unit/domain/rig.h"

namespace ls::coordinator {
namespace {

using namespace std::chrono_literals;

std::string name(std::size_t i) { return "w-" + std::to_string(i); }

// Otherwise one who joins and leaves again and again fills the table of workers, and no worker can join.
TEST(LostWorkers, FewWorkersThatNeverRenderedAreRemembered) {
  Rig rig;
  for (std::size_t i = 0; i < kLostNewcomersKept; ++i) {
    rig.join(name(i), 1);
    EXPECT_TRUE(of<WorkerForgotten>(rig.lose(name(i))).empty());
  }
  rig.join("one more", 1);

  const auto forgotten = of<WorkerForgotten>(rig.lose("one more"));

  ASSERT_EQ(forgotten.size(), 1u);
  EXPECT_EQ(forgotten[0].worker, WorkerId{name(0)}) << "the one that was lost first";
  EXPECT_FALSE(rig.farm.worker({name(0)}));
  EXPECT_TRUE(rig.farm.worker({name(1)}));
}

TEST(LostWorkers, ReturnedWorkerIsNotForgotten) {
  Rig rig;
  rig.join("returns", 1);
  rig.lose("returns");
  rig.join("returns", 1);

  for (std::size_t i = 0; i < 2 * kLostNewcomersKept; ++i) {
    rig.join(name(i), 1);
    rig.lose(name(i));
  }

  EXPECT_EQ(rig.worker("returns").state, WorkerState::connected);
}

TEST(LostWorkers, WorkersThatRenderedOrFailedAreRememberedForAnHour) {
  Rig rig(plan_of("j", 4, 64), {{"renders", 1}, {"fails", 1}});
  rig.render("renders");
  rig.fail("fails");
  rig.lose("renders");
  rig.lose("fails");

  for (std::size_t i = 0; i < 2 * kLostNewcomersKept; ++i) {
    rig.join(name(i), 1);
    rig.lose(name(i));
  }

  EXPECT_TRUE(rig.farm.worker({"renders"}));
  EXPECT_TRUE(rig.farm.worker({"fails"}));
  rig.pass(kForgetWorkerAfter);
  EXPECT_FALSE(rig.farm.worker({"renders"}));
}

TEST(FailureIsNew, IsTrueOnlyForAUnitThatTheWorkerHolds) {
  Rig rig(plan_of("j", 4, 64), {{"holder", 1}});
  rig.join("other", 1, 2);
  const Rig::Held unit = rig.held[{"holder"}].front();

  EXPECT_TRUE(rig.farm.failure_is_new({"holder"}, unit.key()));
  EXPECT_FALSE(rig.farm.failure_is_new({"other"}, unit.key()));
  EXPECT_FALSE(rig.farm.failure_is_new({"unknown"}, unit.key()));
  EXPECT_FALSE(rig.farm.failure_is_new({"holder"}, {{"no job"}, 0, 0}));
  EXPECT_FALSE(rig.farm.failure_is_new({"holder"}, {{"j"}, 4, 0}));
  EXPECT_FALSE(rig.farm.failure_is_new({"holder"}, {{"j"}, 0, 4'000'000'000}));
}

TEST(FailureIsNew, IsFalseOnceTheWorkerIsBlocked) {
  Rig rig(plan_of("j", 16, 64), {{"clumsy", 1}, {"second", 1}, {"third", 1}, {"fourth", 1}});
  std::size_t told = 0;
  while (!rig.held[{"clumsy"}].empty()) {
    told += rig.farm.failure_is_new({"clumsy"}, rig.held[{"clumsy"}].front().key()) ? 1 : 0;
    rig.fail("clumsy");
  }

  EXPECT_EQ(told, kWorkerFailuresPerJob);
}

}  // namespace
}  // namespace ls::coordinator
