// The tiles in the focus get the next samples first, and nothing else changes.
#include "tests/unit/domain/rig.h"

namespace ls::coordinator {
namespace {

using testing::IsEmpty;

// Returns a rectangle over these tiles; tiles are 8 pixels wide, in one row.
PixelRect over_tiles(int first, int last) { return {first * 8 + 3, 0, last * 8 + 4, 8}; }

// Renders all units that the workers hold, and returns the tiles of the leases that follow, in order.
std::vector<TileIndex> next_tiles(Rig& rig, std::size_t count) {
  std::vector<TileIndex> tiles;
  while (tiles.size() < count) {
    const auto effects = rig.render("w");
    for (const auto& [worker, message] : sent<AssignLease>(effects))
      for (const LeaseUnit& unit : message.lease.units) tiles.push_back(unit.tile);
  }
  return tiles;
}

TEST(Focus, TilesInTheFocusAreLeasedFirstUntilTheyHaveAllSamples) {
  Rig rig(plan_of("j", 100, 30), {{"w", 1}});  // 5 rounds
  rig.send(JobFocused{{"j"}, over_tiles(70, 71)});

  const auto tiles = next_tiles(rig, 12);

  EXPECT_EQ(
      std::count(tiles.begin(), tiles.begin() + 10, 70) + std::count(tiles.begin(), tiles.begin() + 10, 71),
      10);
  EXPECT_LT(tiles.at(10), 70u);
  EXPECT_EQ(audit(rig.farm), "");
}

TEST(Focus, RemovingItRestoresTheOrder) {
  Rig rig(plan_of("j", 100, 30), {{"w", 1}});
  const auto plain = next_tiles(rig, 20);
  Rig other(plan_of("j", 100, 30), {{"w", 1}});
  other.send(JobFocused{{"j"}, over_tiles(70, 71)});
  other.send(JobFocused{{"j"}, std::nullopt});
  EXPECT_EQ(next_tiles(other, 20), plain);
}

// The focus changes only the order of leases: the same units are folded, and every tile ends at the same
// round.
TEST(Focus, AdaptiveJobHasTheSameUnitsWithAndWithoutAFocus) {
  const auto units = [](const std::optional<PixelRect>& focus) {
    JobPlan plan = plan_of("j", 24, 4096);
    plan.grid = {{24 * 32, 32}, 32};
    plan.target_error = .004;
    Rig rig(Farm::Options{.lease_prefix = "t"});
    rig.rel_error = [](const UnitKey& unit) {  // dark tiles on the right need many samples
      return 3 * 1024 * (unit.tile < 12 ? .2 : 2.) / static_cast<double>(cut_range(unit.round, 4096).s1);
    };
    rig.join("w", 2);
    rig.submit(plan);
    if (focus) rig.send(JobFocused{{"j"}, focus});
    std::set<std::pair<TileIndex, RoundIndex>> folded;
    for (const Fold& fold : of<Fold>(rig.render_all())) folded.emplace(fold.unit.tile, fold.unit.round);
    EXPECT_EQ(rig.job().state, JobState::done);
    EXPECT_EQ(audit(rig.farm), "");
    return folded;
  };
  const auto plain = units(std::nullopt);
  EXPECT_GT(plain.size(), 24u * 6);
  EXPECT_EQ(units(PixelRect{0, 0, 64, 32}), plain);
  EXPECT_EQ(units(PixelRect{700, 0, 701, 1}), plain);
}

TEST(Focus, ReturnedUnitsFollowItToo) {
  Rig rig(plan_of("j", 40, 2), {{"lost", 2}});
  rig.lose("lost");
  rig.send(JobFocused{{"j"}, over_tiles(30, 30)});
  const auto leases = sent<AssignLease>(rig.join("w", 1));
  ASSERT_FALSE(leases.empty());
  EXPECT_EQ(leases[0].second.lease.units[0].tile, 30u);
}

TEST(Focus, IsStoredWithThePlan) {
  Rig rig(plan_of("j", 10, 8), {});
  const PixelRect focus = over_tiles(7, 8);
  rig.send(JobFocused{{"j"}, focus});
  const JobPlan plan = rig.farm.plan({"j"}).value();
  EXPECT_EQ(plan.focus, focus);

  Rig later;
  later.join("w", 1);
  JobRestored restored;
  restored.plan = plan;
  const auto leases = sent<AssignLease>(later.send(restored));
  ASSERT_FALSE(leases.empty());
  EXPECT_EQ(leases[0].second.lease.units[0].tile, 7u);
}

TEST(Focus, OutsideOfTheFrameIsRefused) {
  Rig rig(plan_of("j", 10, 8), {});
  for (const PixelRect& wrong : {PixelRect{-1, 0, 4, 4}, PixelRect{0, 0, 81, 4}, PixelRect{4, 0, 4, 4},
                                 PixelRect{0, 0, 4, 9}, PixelRect{8, 4, 4, 8}}) {
    rig.send(JobFocused{{"j"}, wrong});
    EXPECT_EQ(rig.farm.plan({"j"})->focus, std::nullopt);
    JobPlan plan = plan_of("k", 10, 8);
    plan.focus = wrong;
    EXPECT_FALSE(check_plan(plan));
  }
}

}  // namespace
}  // namespace ls::coordinator
