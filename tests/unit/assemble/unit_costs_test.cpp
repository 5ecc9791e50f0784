#include <gtest/gtest.h>

#include "coordinator/assemble/assembly.h"

namespace ls::coordinator {
namespace {

using Rounds = std::vector<RoundIndex>;

TEST(UnitCosts, CheckpointCountsOnlyItsUnits) {
  UnitCosts costs(2);
  costs.add(0, 0, 1);
  costs.add(0, 1, 2);
  costs.add(0, 2, 4);  // a later round than the next one
  costs.add(1, 1, 16);
  costs.add(1, 0, 8);

  EXPECT_EQ(costs.until(Rounds{1, 1}), 1 + 8);
  EXPECT_EQ(costs.until(Rounds{2, 2}), 1 + 8 + 2 + 16);
  costs.add(1, 2, 32);
  EXPECT_EQ(costs.until(Rounds{3, 2}), 1 + 8 + 2 + 16 + 4);
  EXPECT_EQ(costs.until(Rounds{3, 3}), 1 + 8 + 2 + 16 + 4 + 32);
}

TEST(UnitCosts, RerenderedUnitCountsTwice) {
  UnitCosts costs(1);
  costs.add(0, 0, 1);
  costs.add(0, 0, 2);
  EXPECT_EQ(costs.until(Rounds{1}), 3);

  costs.add(0, 0, 4);
  EXPECT_EQ(costs.until(Rounds{1}), 7);
}

// A checkpoint may include rounds without recorded cost: of a tile that stopped early, or a truncated last
// round.
TEST(UnitCosts, MissingUnitsCostNothing) {
  UnitCosts costs(2);
  costs.add(0, 0, 1);
  EXPECT_EQ(costs.until(Rounds{4, 0}), 1);
  EXPECT_EQ(costs.until(Rounds{2, 0}), 1);  // fewer rounds than at the earlier checkpoint
  costs.add(0, 5, 8);
  costs.add(0, 3, 2);
  EXPECT_EQ(costs.until(Rounds{4, 0}), 3);
  EXPECT_EQ(costs.until(Rounds{6, 0}), 11);
}

}  // namespace
}  // namespace ls::coordinator
