// More results arrive than the coordinator has room for.
#include "tests/unit/domain/rig.h"

namespace ls::coordinator {
namespace {

// While a result waits, the worker's later messages, with its progress, wait behind it.
TEST(Deadline, DoesNotExpireWhileTheCoordinatorHasNoMemoryForTheResult) {
  Rig rig(plan_of("j", 1, 2), {{"w", 1}});

  for (Duration waited{}; waited < 2 * kNoGrowthLimit; waited += 1s) {
    rig.send(ResultsWait{{"w"}});
    rig.pass(1s);
    ASSERT_EQ(rig.job().units_leased, 1u);
  }
  rig.pass(kDeadlineSlack + kLoadSlack + 10s);

  EXPECT_EQ(rig.job().units_leased, 0u) << "then it counts again";
}

}  // namespace
}  // namespace ls::coordinator
