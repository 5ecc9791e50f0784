// Grids whose values are bricks: the same values, bounds and integrals as of one array, bit for bit, in
// memory in proportion to what is not empty.
#include "worker/render/bricks/bricks.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <utility>
#include <vector>

#include "tests/unit/render/grids.h"
#include "worker/render/media/voxels.h"

namespace ls::render {
namespace {

constexpr std::uint64_t kNoLimit = ~std::uint64_t{0};

// Some balls of random values, some of one value, and nothing elsewhere.
std::vector<float> clouds(Size n, unsigned seed) {
  std::mt19937 rng(seed);
  std::vector<float> v(static_cast<std::size_t>(n[0]) * n[1] * n[2]);
  struct Ball {
    int at[3], radius;
    float value;
  };
  std::vector<Ball> balls(6);
  for (Ball& b : balls) {
    for (int k = 0; k < 3; ++k) b.at[k] = static_cast<int>(rng() % static_cast<unsigned>(n[k]));
    b.radius = 1 + static_cast<int>(rng() % 14);
    b.value = rng() % 2 ? 0 : static_cast<float>(rng()) * 0x1p-32f;
  }
  std::size_t i = 0;
  for (int z = 0; z < n[2]; ++z)
    for (int y = 0; y < n[1]; ++y)
      for (int x = 0; x < n[0]; ++x, ++i)
        for (const Ball& b : balls) {
          const int d[3] = {x - b.at[0], y - b.at[1], z - b.at[2]};
          if (d[0] * d[0] + d[1] * d[1] + d[2] * d[2] > b.radius * b.radius) continue;
          v[i] = b.value > 0 ? b.value : static_cast<float>(rng()) * 0x1p-32f;
        }
  return v;
}

// The tree of these values as if they were in a file in which the box begins at `lead`.
VoxelTree tree_at(const Position& lead, Size n, const std::vector<float>& v) {
  const Position wide{n[0] + lead[0], n[1] + lead[1], n[2] + lead[2]};
  std::vector<float> all(static_cast<std::size_t>(wide[0]) * wide[1] * wide[2]);
  std::size_t i = 0;
  for (int z = 0; z < n[2]; ++z)
    for (int y = 0; y < n[1]; ++y)
      for (int x = 0; x < n[0]; ++x, ++i)
        all[(static_cast<std::size_t>(z + lead[2]) * wide[1] + y + lead[1]) * wide[0] + x + lead[0]] = v[i];
  VoxelTree tree = tree_of(wide, all);
  tree.size = n;
  tree.lead = lead;
  return tree;
}
Voxels as_bricks(const VoxelTree& tree) {
  return Voxels::as_bricks({tree.size, tree.lead, make_bricks(tree, 0, kNoLimit).value()});
}

struct Pair {
  Grid array, bricks;
};
Pair pair_of(Size n, const Position& lead, unsigned seed, VolumeFilter filter, double sigma = 1) {
  const auto v = clouds(n, seed);
  const V3d lo(-.5), hi(n[0] - .5, n[1] - .5, n[2] - .5);
  return {Grid(Voxels::as_array(n, v), Affine(), lo, hi, sigma, filter),
          Grid(as_bricks(tree_at(lead, n, v)), Affine(), lo, hi, sigma, filter)};
}
const std::pair<Size, Position> kBoxes[] = {{{1, 1, 1}, {0, 0, 0}},       {{8, 8, 8}, {0, 0, 0}},
                                            {{9, 1, 40}, {7, 127, 3}},    {{40, 33, 20}, {125, 0, 60}},
                                            {{130, 20, 17}, {1, 120, 8}}, {{1, 64, 1}, {0, 100, 127}}};

TEST(Bricks, GiveTheBitsOfAnArrayAtAllPlaces) {
  std::mt19937 rng(1);
  std::uniform_real_distribution<float> u(-.2f, 1.2f);
  for (const auto& [n, lead] : kBoxes)
    for (const auto filter : {kTrilinear, kNearest}) {
      const auto [array, bricks] = pair_of(n, lead, 5, filter);
      ASSERT_TRUE(array.voxels().dense());
      ASSERT_FALSE(bricks.voxels().dense());
      EXPECT_EQ(array.max_value(), bricks.max_value());
      for (int i = 0; i < 20'000; ++i) {
        const V3 q(u(rng) * static_cast<float>(n[0]), u(rng) * static_cast<float>(n[1]),
                   u(rng) * static_cast<float>(n[2]));
        ASSERT_EQ(array.value_anywhere(q), bricks.value_anywhere(q)) << q.x << " " << q.y << " " << q.z;
      }
      for (int z = 0; z < n[2]; ++z)
        for (int y = 0; y < n[1]; ++y)
          for (int x = 0; x < n[0]; ++x) ASSERT_EQ(array.voxels().at(x, y, z), bricks.voxels().at(x, y, z));
    }
}

TEST(Bricks, HaveTheMacroCellsBoundsAndCountsOfAnArray) {
  std::mt19937 rng(2);
  for (const auto& [n, lead] : kBoxes)
    for (const int size : {4, 8, 16, 64}) {
      auto [array, bricks] = pair_of(n, lead, 9, kTrilinear);
      array.use_cells(size);
      bricks.use_cells(size);
      ASSERT_EQ(array.cells(), bricks.cells());
      const auto cells = array.majorant_bytes() / sizeof(MacroCell);
      for (std::size_t i = 0; i < cells; ++i) {
        ASSERT_EQ(array.cell(i).hi, bricks.cell(i).hi);
        // A sum of n numbers in double is off by at most n * 2^-53 of it, and the mean is rounded to float32.
        const float off = size > 16 ? array.cell(i).control * 0x1p-23f : 0;
        ASSERT_NEAR(array.cell(i).control, bricks.cell(i).control, off);
        ASSERT_NEAR(array.cell(i).residual, bricks.cell(i).residual, 2 * off);
      }
      for (const float limit : {0.f, .3f}) EXPECT_EQ(array.count_above(limit), bricks.count_above(limit));
      for (int i = 0; i < 100; ++i) {
        V3d lo, hi;
        for (int k = 0; k < 3; ++k) {
          lo[k] = static_cast<double>(rng() % 1000) / 900 * n[k] - 1;
          hi[k] = lo[k] + static_cast<double>(rng() % 1000) / 1000 * n[k];
        }
        ASSERT_EQ(array.bounds(lo, hi).lo, bricks.bounds(lo, hi).lo);
        ASSERT_EQ(array.bounds(lo, hi).hi, bricks.bounds(lo, hi).hi);
      }
    }
}

TEST(Bricks, KeepHalvesAsTheyAre) {
  std::mt19937 rng(6);
  std::uniform_real_distribution<float> u(0, 1);
  const Size n{70, 33, 20};
  std::vector<float> v = clouds(n, 8);
  for (float& x : v) x = Imath::half(x);
  const auto grid = [&](Voxels voxels) {
    return Grid(std::move(voxels), Affine(), V3d(0), V3d(n[0] - 1, n[1] - 1, n[2] - 1), 1);
  };
  const VoxelTree tree = tree_at({100, 0, 5}, n, v);
  const Grid array = grid(Voxels::as_array(n, v)), halves = grid(as_bricks(tree));

  EXPECT_TRUE(halves.voxels().halves());
  const OwnBricks bricks = make_bricks(tree, 0, kNoLimit).value();
  EXPECT_TRUE(bricks.floats.empty());
  EXPECT_TRUE(Bricks::sound(tree.size, tree.lead, bricks));
  for (int i = 0; i < 20'000; ++i) {
    const V3 q(u(rng) * 70, u(rng) * 33, u(rng) * 20);
    ASSERT_EQ(array.value_anywhere(q), halves.value_anywhere(q));
  }
  ASSERT_EQ(array.cells(), halves.cells());
  for (std::size_t i = 0; i < array.majorant_bytes() / sizeof(MacroCell); ++i) {
    ASSERT_EQ(array.cell(i).hi, halves.cell(i).hi);
    ASSERT_EQ(array.cell(i).control, halves.cell(i).control);
  }
  EXPECT_EQ(array.count_above(.3f), halves.count_above(.3f));

  v[v.size() / 2] = .1f;  // no half
  EXPECT_FALSE(as_bricks(tree_of(n, v)).halves());
}

TEST(Bricks, AreIntegratedLikeAnArray) {
  std::mt19937 rng(3);
  const auto [array, bricks] = pair_of({70, 50, 40}, {99, 5, 2}, 4, kTrilinear);
  int reached = 0;
  for (int i = 0; i < 400; ++i) {
    const V3 o(V3d(35, 25, 20) - random_direction(rng) * 40), d(random_direction(rng));
    const Passage all = array.pass(o, d, 0, 80), same = bricks.pass(o, d, 0, 80);
    EXPECT_EQ(all.integral, same.integral);
    const Passage half = array.pass(o, d, 0, 80, all.integral / 2),
                  other = bricks.pass(o, d, 0, 80, all.integral / 2);
    EXPECT_EQ(half.t, other.t);
    reached += half.reached && half.t > 0;
  }
  EXPECT_GT(reached, 40);
}

TEST(Bricks, OfThreeGridsHaveTheMeansOfArrays) {
  const Size n{60, 44, 30};
  std::vector<Pair> of;
  for (const unsigned seed : {1u, 2u, 3u}) of.push_back(pair_of(n, {3, 9, 120}, seed, kTrilinear));
  const Grid array = Grid::mean(of[0].array, of[1].array, of[2].array),
             bricks = Grid::mean(of[0].bricks, of[1].bricks, of[2].bricks);

  ASSERT_FALSE(bricks.voxels().dense());
  for (int z = 0; z < n[2]; ++z)
    for (int y = 0; y < n[1]; ++y)
      for (int x = 0; x < n[0]; ++x) ASSERT_EQ(array.voxels().at(x, y, z), bricks.voxels().at(x, y, z));
  EXPECT_EQ(array.max_value(), bricks.max_value());
  EXPECT_TRUE(of[0].bricks.same_values(pair_of(n, {3, 9, 120}, 1, kTrilinear).bricks));
  EXPECT_FALSE(of[0].bricks.same_values(of[1].bricks));
  EXPECT_FALSE(of[0].bricks.same_values(of[0].array));
}

// Returns the tree of a file with a box of 4096^3 voxels of one value inside an empty border.
VoxelTree large_tile() {
  VoxelTree tree;
  tree.size = {4098, 4098, 4098};
  tree.lead = {127, 127, 127};
  const float none = 0, smoke = .25f;
  const std::uint32_t empty = tree.constant(&none), full = tree.constant(&smoke);
  const Position n = table_size(tree.size, tree.lead);
  for (int z = 0; z < n[2]; ++z)
    for (int y = 0; y < n[1]; ++y)
      for (int x = 0; x < n[0]; ++x)
        tree.table.push_back(std::min({x, y, z}) > 0 && std::max({x, y, z}) < 33 ? full : empty);
  return tree;
}

TEST(Bricks, StoreALargeTileOnce) {
  const VoxelTree tree = large_tile();

  const Voxels voxels = as_bricks(tree);

  // The table has 34^3 entries. Bricks are full, empty, or at one of the faces, edges and corners of the
  // tile, on either side of it: 26 kinds; nodes are of as many kinds.
  EXPECT_LE(voxels.bytes(), 4 * 34 * 34 * 34 + 28 * (4 * kBrickValues + 4 * kNodeEntries));
  EXPECT_EQ(voxels.count(), std::uint64_t{4098} * 4098 * 4098);
  for (const int x : {0, 1, 2, 4095, 4096, 4097})
    for (const int z : {0, 1, 2000, 4096, 4097})
      EXPECT_EQ(voxels.at(x, 100, z), x > 0 && x < 4097 && z > 0 && z < 4097 ? .25f : 0.f);
  EXPECT_EQ(voxels.count_above(0, {0, 0, 0}, {99, 99, 99}), 99u * 99 * 99);

  const Grid grid(voxels, Affine(), V3d(0), V3d(4097), 1e30);
  // 4098^3 voxels in cells of 4^3 would be 1.07e9 of them.
  EXPECT_LE(grid.majorant_bytes() / sizeof(MacroCell), std::uint64_t{1} << 22);
  EXPECT_EQ(grid.value_anywhere(V3(4096.5f, 2000.25f, 77)), .125f);
}

TEST(Bricks, AreRefusedAboveALimitOfBytes) {
  const Size n{64, 64, 64};
  const VoxelTree tree = tree_of(n, random_values(n, 1));
  const std::uint64_t bytes = BrickTables(make_bricks(tree, 0, kNoLimit).value()).bytes();

  EXPECT_TRUE(make_bricks(tree, 0, bytes));
  const auto refused = make_bricks(tree, 0, bytes - 1);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, Errc::resource_exhausted);
}

TEST(Bricks, AreTheSameWhileLeavesAreFreed) {
  const Size n{300, 140, 150};
  const VoxelTree tree = tree_at({100, 5, 120}, n, random_values(n, 4, true));
  VoxelTree spent = tree;

  const OwnBricks kept = make_bricks(tree, 0, kNoLimit).value(),
                  freed = make_last_bricks(std::move(spent), 0, kNoLimit).value();

  EXPECT_EQ(kept.table, freed.table);
  EXPECT_EQ(kept.nodes, freed.nodes);
  EXPECT_EQ(kept.floats, freed.floats);
}

TEST(Bricks, WithNumbersOfNothingAreNotSound) {
  const Size n{20, 20, 20};
  const OwnBricks good = make_bricks(tree_of(n, random_values(n, 1, true)), 0, kNoLimit).value();
  const auto sound = [&](auto change) {
    OwnBricks bricks = good;
    change(bricks);
    return Bricks::sound(n, {0, 0, 0}, bricks);
  };

  EXPECT_TRUE(sound([](OwnBricks&) {}));
  EXPECT_FALSE(sound([](OwnBricks& b) { b.table[0] = 2; }));
  EXPECT_FALSE(sound([](OwnBricks& b) { b.table.push_back(0); }));
  EXPECT_FALSE(sound([](OwnBricks& b) { b.table.clear(); }));
  EXPECT_FALSE(sound([](OwnBricks& b) { b.nodes.back() = 1000; }));
  EXPECT_FALSE(sound([](OwnBricks& b) { b.nodes[5] = 1; }));
  EXPECT_FALSE(sound([](OwnBricks& b) { b.nodes.pop_back(); }));
  EXPECT_FALSE(sound([](OwnBricks& b) { b.floats[7] = 1; }));
  EXPECT_FALSE(sound([](OwnBricks& b) { b.floats.pop_back(); }));
  EXPECT_FALSE(sound([](OwnBricks& b) { b.floats.clear(); }));
  EXPECT_FALSE(sound([](OwnBricks& b) { b.halves.resize(kBrickValues); }));
}

TEST(Voxels, AreBricksWhereThatSavesMemory) {
  const Size n{300, 300, 300};
  const std::vector<float> some = clouds(n, 3);

  EXPECT_TRUE(Voxels({60, 60, 60}, clouds({60, 60, 60}, 3)).dense());
  EXPECT_TRUE(Voxels(n, random_values(n, 1)).dense());
  const Voxels sparse(n, some);
  ASSERT_FALSE(sparse.dense());
  EXPECT_LT(sparse.bytes(), some.size());  // a quarter of 4 bytes a value
  std::size_t i = 0;
  bool same = true;
  for (int z = 0; z < n[2]; ++z)
    for (int y = 0; y < n[1]; ++y)
      for (int x = 0; x < n[0]; ++x, ++i) same &= sparse.at(x, y, z) == some[i];
  EXPECT_TRUE(same);
}

}  // namespace
}  // namespace ls::render
