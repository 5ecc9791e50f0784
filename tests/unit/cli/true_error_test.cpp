#include "cli/true_error.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "common/image/rounds.h"

namespace ls::cli {
namespace {

constexpr TileGrid kGrid{{3, 2}, 2};  // two tiles: 2 x 2 and 1 x 2

// Every sample of the tile has this value.
Partial constant(TileIndex tile, RoundIndex round, float value) {
  Partial p;
  p.header.tile = kGrid.rect(tile);
  p.header.samples = round_range(round);
  const auto count = static_cast<float>(p.header.samples.count()) / 2;
  p.sums.assign(static_cast<std::size_t>(kPartialChannels * p.header.tile.pixels()), count * value);
  return p;
}

RgbImage grey(float value) { return {{3, 2}, std::vector<float>(18, value)}; }

TEST(TrueError, IsTheErrorOfTheFoldedImageAtEachRound) {
  auto truth = TrueError::make(kGrid, grey(1));
  ASSERT_TRUE(truth);
  // Round 0: 2 samples of 3; round 1: 2 more of 1, so the mean is 2. The tiles have the same values.
  for (const TileIndex tile : {0u, 1u}) {
    ASSERT_TRUE(truth->add(tile, 1, constant(tile, 1, 1)));  // before its turn
    ASSERT_TRUE(truth->add(tile, 0, constant(tile, 0, 3)));
  }

  const auto points = truth->points(std::vector<RoundIndex>{2, 2});

  ASSERT_EQ(points.size(), 2u);
  EXPECT_EQ(points[0].spp, 2);
  EXPECT_DOUBLE_EQ(points[0].rmse, 2);
  EXPECT_DOUBLE_EQ(points[0].relmse, 4 / 1.01);
  EXPECT_EQ(points[1].spp, 4);
  EXPECT_DOUBLE_EQ(points[1].rmse, 1);
  EXPECT_DOUBLE_EQ(points[1].relmse, 1 / 1.01);
}

TEST(TrueError, LetsAStoppedTileStandWithItsLastFigures) {
  auto truth = TrueError::make(kGrid, grey(0));
  ASSERT_TRUE(truth);
  ASSERT_TRUE(truth->add(0, 0, constant(0, 0, 1)));
  ASSERT_TRUE(truth->add(0, 1, constant(0, 1, 5)));  // rendered ahead, then dropped
  ASSERT_TRUE(truth->add(1, 0, constant(1, 0, 2)));
  ASSERT_TRUE(truth->add(1, 1, constant(1, 1, 2)));

  const auto points = truth->points(std::vector<RoundIndex>{1, 2});

  ASSERT_EQ(points.size(), 2u);
  EXPECT_DOUBLE_EQ(points[1].spp, (4 * 2 + 2 * 4) / 6.0);
  EXPECT_DOUBLE_EQ(points[1].rmse, std::sqrt((4 * 1 + 2 * 4) / 6.0));
}

TEST(TrueError, SaysNothingWhileATileHasNoRound) {
  auto truth = TrueError::make(kGrid, grey(0));
  ASSERT_TRUE(truth);
  ASSERT_TRUE(truth->add(0, 0, constant(0, 0, 1)));

  EXPECT_TRUE(truth->points(std::vector<RoundIndex>{1, 0}).empty());
}

TEST(TrueError, IgnoresAUnitThatComesTwice) {
  auto truth = TrueError::make(kGrid, grey(0));
  ASSERT_TRUE(truth);
  for (int i = 0; i < 2; ++i)
    for (const TileIndex tile : {0u, 1u}) ASSERT_TRUE(truth->add(tile, 0, constant(tile, 0, 1)));

  EXPECT_EQ(truth->points(std::vector<RoundIndex>{1, 1}).size(), 1u);
}

TEST(TrueError, RefusesAReferenceThatDoesNotFit) {
  EXPECT_THAT(TrueError::make(kGrid, {{2, 3}, std::vector<float>(18)}).error().message,
              testing::HasSubstr("2 x 3"));
  RgbImage bad = grey(1);
  bad.rgb[4] = std::numeric_limits<float>::quiet_NaN();
  EXPECT_THAT(TrueError::make(kGrid, bad).error().message, testing::HasSubstr("NaN"));
}

}  // namespace
}  // namespace ls::cli
