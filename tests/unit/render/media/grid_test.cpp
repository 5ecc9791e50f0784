// Tests density grids: interpolation, exact integrals, and the traversal of macro cells.
#include "worker/render/media/grid.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "tests/support/scene_builder.h"
#include "tests/unit/render/grids.h"
#include "worker/render/media/grid_load.h"

namespace ls::render {
namespace {

TEST(Grid, InterpolatesToItsNodesAndClampsBeyondThem) {
  const Size n{2, 3, 4};
  const auto values = random_values(n, 1);
  const Grid g = unit_grid(n, values, .5);
  for (int z = 0; z < 4; ++z)
    for (int y = 0; y < 3; ++y)
      for (int x = 0; x < 2; ++x)
        // The tolerance allows for three lerps of numbers below 1, each rounded twice.
        EXPECT_NEAR(g.value<Lookup::trilinear>(V3(x, y, z)),
                    values[static_cast<std::size_t>((z * 3 + y) * 2 + x)], 6 * 0x1p-25);

  EXPECT_EQ(g.value<Lookup::trilinear>(V3(-.4f, -.4f, -.4f)), values.front());
  EXPECT_EQ(g.value<Lookup::trilinear>(V3(1.5f, 2.5f, 3.5f)), g.value<Lookup::trilinear>(V3(1, 2, 3)));
  EXPECT_FLOAT_EQ(g.value<Lookup::trilinear>(V3(.5f, 0, 0)), (values[0] + values[1]) / 2);
}

TEST(Grid, DiagonalOfTheProductOfCoordinatesIsTheRootOfThreeQuarters) {
  std::vector<float> v(8, 0);
  v[7] = 1;  // density = x y z
  EXPECT_NEAR(exact_integral(unit_grid({2, 2, 2}, v), {0, 0, 0}, {1, 1, 1}, 0, 1) * std::sqrt(3.),
              std::sqrt(3.) / 4, 1e-15);
}

TEST(Grid, IntegralsOfTentRampAndConstantMatchClosedForms) {
  std::vector<float> tent(27, 0);
  tent[13] = 5;
  EXPECT_NEAR(exact_integral(unit_grid({3, 3, 3}, tent), {-4, 1, 1}, {1, 0, 0}, 0, 10), 5, 1e-14);  // rho h

  const Grid ramp = unit_grid({4, 1, 1}, {0, 1, 2, 3}, .5);
  EXPECT_NEAR(exact_integral(ramp, {-9, 0, 0}, {1, 0, 0}, 0, 99), 4.5 + 1.5,
              1e-13);  // the clamped half voxels add 0 and 3/2
  EXPECT_NEAR(exact_integral(ramp, {1.25, 0, 0}, {-1, 0, 0}, 0, 1), .5 * (1.25 * 1.25 - .25 * .25), 1e-14);

  const Grid constant = unit_grid({2, 3, 4}, std::vector<float>(24, 3), .5);
  EXPECT_NEAR(exact_integral(constant, {-9, 1, 1}, {1, 0, 0}, 0, 99), 3 * 2,
              1e-13);  // 1 voxel and two halves
  EXPECT_EQ(exact_integral(constant, {-9, 7, 1}, {1, 0, 0}, 0, 99), 0);
}

TEST(Grid, VoxelsAreConstantWithoutInterpolation) {
  const Size n{3, 2, 4};
  const auto values = random_values(n, 9);
  for (const Wrap wrap : {Wrap::clamp, Wrap::repeat, Wrap::mirror}) {
    const Grid g = voxel_grid(n, values, kNearest, wrap);
    for (int z = 0; z < 4; ++z)
      for (int y = 0; y < 2; ++y)
        for (int x = 0; x < 3; ++x)
          for (const float off : {-.49f, 0.f, .2f, .49f}) {
            const V3 p(static_cast<float>(x) + off, static_cast<float>(y) - off, static_cast<float>(z) + off);
            ASSERT_EQ(g.value<Lookup::nearest>(g.to_index(p)),
                      values[static_cast<std::size_t>((z * 2 + y) * 3 + x)]);
          }
  }
}

TEST(Grid, IntegralsWithoutInterpolationAreSumsOfVoxels) {
  const Grid g = voxel_grid({4, 1, 1}, {7, 1, 2, 5}, kNearest, Wrap::clamp);
  EXPECT_NEAR(exact_integral(g, {-9, 0, 0}, {1, 0, 0}, 0, 99), 7 + 1 + 2 + 5, 1e-13);
  EXPECT_NEAR(exact_integral(g, {-.25, 0, 0}, {1, 0, 0}, 0, 1), .75 * 7 + .25 * 1, 1e-14);
  const Grid block = voxel_grid({2, 2, 2}, {1, 2, 3, 4, 5, 6, 7, 8}, kNearest, Wrap::clamp);
  EXPECT_NEAR(exact_integral(block, {-.5, -.5, -.5}, {1, 1, 1}, 0, 2), 1 + 8, 1e-14);
}

TEST(Grid, RepeatedEndsAreInterpolatedWithEachOther) {
  const Grid clamped = voxel_grid({4, 1, 1}, {0, 1, 2, 3}, kTrilinear, Wrap::clamp),
             mirrored = voxel_grid({4, 1, 1}, {0, 1, 2, 3}, kTrilinear, Wrap::mirror),
             repeated = voxel_grid({4, 1, 1}, {0, 1, 2, 3}, kTrilinear, Wrap::repeat);
  for (int i = -8; i <= 56; ++i) {
    const float x = static_cast<float>(i) / 16;
    // Between the last node and the first, the value falls from 3 to 0 over the distance 1.
    const float expected = x < 0 ? -3 * x : x > 3 ? 3 * (4 - x) : x;
    EXPECT_FLOAT_EQ(value_at(repeated, {x, 0, 0}), expected) << x;
    EXPECT_EQ(value_at(clamped, {x, 0, 0}), std::min(std::max(x, 0.f), 3.f));
    EXPECT_EQ(value_at(mirrored, {x, 0, 0}), std::min(std::max(x, 0.f), 3.f));
  }
  const auto first_half = [](const Grid& g) { return exact_integral(g, {-9, 0, 0}, {1, 0, 0}, 0, 9); };
  EXPECT_NEAR(first_half(clamped), 0, 1e-14);
  EXPECT_NEAR(first_half(mirrored), 0, 1e-14);
  EXPECT_NEAR(first_half(repeated), .5 * (1.5 + 0) / 2, 1e-14);  // a trapezium
}

TEST(Grid, WrapModeExtendsAGridBeyondItsBox) {
  const Size n{3, 2, 2};
  const auto values = random_values(n, 10);
  std::mt19937 rng(2);
  for (const VolumeFilter filter : {kNearest, kTrilinear}) {
    const Grid clamped = voxel_grid(n, values, filter, Wrap::clamp),
               repeated = voxel_grid(n, values, filter, Wrap::repeat),
               mirrored = voxel_grid(n, values, filter, Wrap::mirror);
    for (int i = 0; i < 1000; ++i) {
      // Multiples of 1/16, moved by 1/32 away from the faces of voxels: adding multiples of the box is exact.
      const auto draw = [&](int cells) {
        return static_cast<float>(rng() % static_cast<unsigned>(16 * cells)) / 16 - .5f + 1.f / 32;
      };
      const V3 in(draw(3), draw(2), draw(2));
      const int turn = static_cast<int>(rng() % 7) - 3;
      const V3 out(in.x + static_cast<float>(3 * turn), in.y, in.z);
      const float width = 3, folded = turn % 2 == 0 ? in.x : width - 1 - in.x;
      // Positions are rounded to 2^-22, and neighbouring voxels differ by at most 1.
      const float slack = filter == kNearest ? 0 : 0x1p-18f;
      ASSERT_NEAR(value_at(repeated, out), value_at(repeated, in), slack) << out;
      ASSERT_NEAR(value_at(mirrored, out), value_at(mirrored, {folded, in.y, in.z}), slack) << out;
      const float edge = turn == 0 ? in.x : turn > 0 ? 2 : 0;
      ASSERT_EQ(value_at(clamped, out), value_at(clamped, {edge, in.y, in.z})) << out;
    }
  }
}

TEST(Grid, SceneChoosesFilterAndWrapMode) {
  const auto grid_of = [](VolumeFilter filter, Wrap wrap) {
    test::SceneBuilder builder({1, 1});
    const VolumeIndex v = builder.grid({2, 1, 1}, {1, 3}, Transform());
    auto& volume = std::get<GridVolume>(builder.scene.volumes[v.value]);
    volume.filter = filter;
    volume.wrap = wrap;
    auto loaded = load_volume(volume, AssetLoader{builder.scene, builder.files}, V3d(0), 1, 1);
    return std::move(loaded.value().channels.at(0));
  };
  // Voxels are half a unit wide; their centres are at 1/4 and 3/4.
  const V3 near_left(.125f, .5f, .5f), middle(.4375f, .5f, .5f), outside(1.25f, .5f, .5f);
  EXPECT_FLOAT_EQ(value_at(grid_of(kTrilinear, Wrap::clamp), near_left), 1);
  EXPECT_FLOAT_EQ(value_at(grid_of(kTrilinear, Wrap::clamp), middle), 1.75f);
  EXPECT_FLOAT_EQ(value_at(grid_of(kTrilinear, Wrap::clamp), outside), 3);
  EXPECT_FLOAT_EQ(value_at(grid_of(kTrilinear, Wrap::repeat), near_left), 1.5f);
  EXPECT_FLOAT_EQ(value_at(grid_of(kTrilinear, Wrap::repeat), outside), 1);
  EXPECT_FLOAT_EQ(value_at(grid_of(kTrilinear, Wrap::mirror), near_left), 1);
  EXPECT_FLOAT_EQ(value_at(grid_of(kTrilinear, Wrap::mirror), outside), 3);
  EXPECT_EQ(value_at(grid_of(kNearest, Wrap::clamp), middle), 1);
  EXPECT_EQ(value_at(grid_of(kNearest, Wrap::repeat), outside), 1);
  EXPECT_EQ(value_at(grid_of(kNearest, Wrap::mirror), outside), 3);
}

TEST(Grid, NodesSpanTheBoxAndBeyondItIsZero) {
  const auto load = [](const std::array<int, 3>& size, const std::vector<float>& values) {
    test::SceneBuilder builder({1, 1});
    const VolumeIndex v = builder.grid(size, values, Transform());
    auto& volume = std::get<GridVolume>(builder.scene.volumes[v.value]);
    volume.node_centred = true;
    return load_volume(volume, AssetLoader{builder.scene, builder.files}, V3d(0), 1, 1);
  };
  const auto loaded = load({3, 2, 2}, {0, 2, 8, 0, 2, 8, 0, 2, 8, 0, 2, 8});
  ASSERT_TRUE(loaded) << loaded.error().message;
  const Grid& g = loaded->channels.at(0);
  EXPECT_FLOAT_EQ(value_at(g, {0, .5f, .5f}), 0);
  EXPECT_FLOAT_EQ(value_at(g, {.25f, .5f, .5f}), 1);
  EXPECT_FLOAT_EQ(value_at(g, {.5f, .5f, .5f}), 2);
  EXPECT_FLOAT_EQ(value_at(g, {1, .5f, .5f}), 8);
  EXPECT_EQ(g.domain_lo().x, 0);
  EXPECT_EQ(g.domain_hi().x, 2);

  const auto flat = load({3, 1, 2}, {1, 1, 1, 1, 1, 1});
  ASSERT_FALSE(flat);
  EXPECT_NE(flat.error().message.find("3 x 1 x 2 values can't be nodes"), std::string::npos)
      << flat.error().message;
}

// The grid has four voxels along x, of which the middle two fill the box.
TEST(Grid, BorderIsUsedOnlyForInterpolation) {
  const auto load = [](const std::array<int, 3>& size, Wrap wrap, bool node_centred) {
    test::SceneBuilder builder({1, 1});
    std::vector<float> values;
    for (int i = 0; i < size[0] * size[1] * size[2]; ++i)
      values.push_back(std::array{0.f, 2.f, 6.f, 0.f}[static_cast<std::size_t>(i % size[0])]);
    const VolumeIndex v = builder.grid(size, values, Transform());
    auto& volume = std::get<GridVolume>(builder.scene.volumes[v.value]);
    volume.border = true;
    volume.wrap = wrap;
    volume.node_centred = node_centred;
    return load_volume(volume, AssetLoader{builder.scene, builder.files}, V3d(0), 1, 1);
  };
  const auto loaded = load({4, 3, 3}, Wrap::clamp, false);
  ASSERT_TRUE(loaded) << loaded.error().message;
  const Grid& g = loaded->channels.at(0);
  EXPECT_FLOAT_EQ(value_at(g, {0, .5f, .5f}), 1);
  EXPECT_FLOAT_EQ(value_at(g, {.25f, .5f, .5f}), 2);
  EXPECT_FLOAT_EQ(value_at(g, {.5f, .5f, .5f}), 4);
  EXPECT_FLOAT_EQ(value_at(g, {.75f, .5f, .5f}), 6);
  EXPECT_FLOAT_EQ(value_at(g, {1, .5f, .5f}), 3);
  EXPECT_TRUE(g.in_domain(g.to_index({0, 0, 0})));
  EXPECT_TRUE(g.in_domain(g.to_index({1, 1, 1})));
  EXPECT_FALSE(g.in_domain(g.to_index({1.001f, .5f, .5f})));
  EXPECT_FALSE(g.in_domain(g.to_index({.5f, -.001f, .5f})));
  // The field is 0 outside of the box. The integral is that of trapezoids of widths 1/4, 1/2 and 1/4.
  EXPECT_NEAR(exact_integral(g, V3d(-3, .5, .5), V3d(1, 0, 0), 0, 9), .25 * 1.5 + .5 * 4 + .25 * 4.5, 1e-6);

  EXPECT_FALSE(load({4, 2, 3}, Wrap::clamp, false));
  EXPECT_FALSE(load({4, 3, 3}, Wrap::repeat, false));
  EXPECT_FALSE(load({4, 3, 3}, Wrap::clamp, true));
}

TEST(Grid, ConstantVolumeFillsItsTransformedCube) {
  const test::SceneBuilder builder({1, 1});
  using test::operator*;
  const auto length = [&](const Transform& to_world, const V3d& o, double center, double scale) {
    const auto loaded = load_volume(ConstVolume{{2, 2, 2}, to_world},
                                    AssetLoader{builder.scene, builder.files}, V3d(center), scale, 1);
    return exact_integral(loaded.value().channels.at(0), (o - V3d(center)) * scale, V3d(1, 0, 0), 0,
                          20 * scale) /
           (2 * scale);
  };
  EXPECT_NEAR(length({}, {-9, .25, .25}, 0, 1), 1, 1e-6);
  EXPECT_NEAR(length({}, {-9, -.25, .25}, 0, 1), 0, 1e-6);
  const Transform moved = test::translate({-.5, -.5, -.5});
  EXPECT_NEAR(length(moved, {-9, -.25, .25}, 0, 1), 1, 1e-6);
  EXPECT_NEAR(length(moved, {-9, -.25, .25}, 3, .125), 1, 1e-6);
  EXPECT_NEAR(length(moved, {-9, .75, .25}, 0, 1), 0, 1e-6);
  const Transform turned = test::scale(3) * test::rotate_x(45) * moved;
  EXPECT_NEAR(length(turned, {-9, 2.1, 0}, 0, 1), 3, 1e-6);
  EXPECT_NEAR(length(turned, {-9, 1.4, 1.4}, 0, 1), 0, 1e-6);
}

struct Ray {
  V3 o, d;
};
std::vector<Ray> awkward_rays() {
  std::vector<Ray> rays = {
      {{-3, 4, 4}, {1, 0, 0}},           {{-3, 4, 4}, {1, -0.f, -0.f}},   {{20, 0, 0}, {-1, 0, 0}},
      {{4, 4, -1}, {0, 0, 1}},           {{-1, -1, -1}, {.5f, .5f, .5f}}, {{20, 20, 20}, {-1, -1, -1}},
      {{4, -2, 8}, {1e-38f, 1, 1e-38f}}, {{4, -2, 8}, {1e-41f, 1, 0}},    {{0, 0, 0}, {1, 1e-7f, 0}},
      {{3.3f, 4.4f, 5.5f}, {0, -1, 0}},  {{8, 8, 8}, {.6f, .8f, 0}},      {{-1e6f, 5, 5}, {1, 1e-9f, 0}}};
  std::mt19937 rng(4);
  for (int i = 0; i < 2000; ++i) {
    const V3d d = random_direction(rng), o = V3d(6) + random_direction(rng) * 20.;
    rays.push_back({V3(o), V3(i % 2 ? d : (V3d(6) - o).normalized())});
  }
  return rays;
}

TEST(CellWalk, CoversTheRayInTheDomainOnceAndInOrder) {
  const Grid g = unit_grid({13, 14, 11}, random_values({13, 14, 11}, 2), 0, 10);
  ASSERT_EQ(g.cell_size(), 4);
  const auto cells = g.cells();
  for (const Ray& r : awkward_rays()) {
    float last = -1, total = 0, first = -1;
    int count = 0;
    for (CellWalk w(g, r.o, r.d, 0, 2e6f); w.next(); ++count) {
      if (first < 0) first = w.begin();
      if (last >= 0) {
        ASSERT_EQ(w.begin(), last) << "a gap";
      }
      ASSERT_GE(w.end(), w.begin());
      total += w.end() - w.begin();
      last = w.end();
      ASSERT_LE(count, cells[0] + cells[1] + cells[2] + 3);
    }
    // The chord of the ray through the domain, in double.
    double t0 = 0, t1 = 2e6;
    const double hi[3] = {12, 13, 10};
    for (int k = 0; k < 3; ++k) {
      if (r.d[k] == 0) {
        if (r.o[k] < 0 || r.o[k] > hi[k]) t1 = -1;
        continue;
      }
      const double a = -double{r.o[k]} / r.d[k], b = (hi[k] - r.o[k]) / r.d[k];
      t0 = std::max(t0, std::min(a, b));
      t1 = std::min(t1, std::max(a, b));
    }
    const double chord = std::max(0., t1 - t0);
    // The ends are rounded to float32, relative to their distance.
    ASSERT_NEAR(last >= 0 ? last - first : 0, chord, 0x1p-22 * std::max(1., std::abs(t1)))
        << "o " << r.o << " d " << r.d;
  }
}

TEST(CellWalk, BoundsHoldAtEveryPointOfEveryCell) {
  const Size n{13, 14, 11};
  std::vector<Grid> grids;
  for (const bool sparse : {false, true}) {
    grids.push_back(unit_grid(n, random_values(n, 3, sparse), .5, 10));
    for (const VolumeFilter filter : {kNearest, kTrilinear})
      for (const Wrap wrap : {Wrap::clamp, Wrap::repeat, Wrap::mirror})
        grids.push_back(voxel_grid(n, random_values(n, 3, sparse), filter, wrap, 10));
  }
  for (const Grid& g : grids) {
    for (const Ray& r : awkward_rays()) {
      for (CellWalk w(g, r.o, r.d, 0, 100); w.next();) {
        for (int i = 0; i <= 8; ++i) {
          const V3 q = w.index(w.begin() + (w.end() - w.begin()) * static_cast<float>(i) / 8);
          const float v = g.value_anywhere(q);
          ASSERT_LE(v, w.cell().hi);
          ASSERT_LE(std::abs(v - w.cell().control), w.cell().residual);
        }
      }
    }
  }
}

TEST(CellWalk, MajorantDepthDoesNotDependOnHowARayIsCut) {
  const Grid g = unit_grid({13, 14, 11}, random_values({13, 14, 11}, 2), 0, 10);
  const auto depth = [&](const Ray& r, int parts) {
    double sum = 0;
    for (int i = 0; i < parts; ++i) {
      const float a = 40.f * static_cast<float>(i) / static_cast<float>(parts),
                  b = 40.f * static_cast<float>(i + 1) / static_cast<float>(parts);
      for (CellWalk w(g, r.o, r.d, a, b); w.next();) sum += w.cell().hi * (w.end() - w.begin());
    }
    return sum;
  };
  std::mt19937 rng(8);
  for (int i = 0; i < 50; ++i) {
    const Ray r{V3(V3d(6) + random_direction(rng) * 20.), V3(random_direction(rng))};
    // Each cut, and each of up to 12 boundaries, has an error of 2^-23 of 40, the largest distance; rates are
    // at most 1.
    EXPECT_NEAR(depth(r, 1), depth(r, 10), (12 + 10) * 40 * 0x1p-22);
    EXPECT_NEAR(depth(r, 1), depth(r, 1000), (12 + 1000) * 40 * 0x1p-22);
  }
}

// A grid of a thousandth of the world, seen from the other end of the world. It has 128 voxels of width 8e-6.
// Float32 positions of the ray's origin, and distances from it, are at least 1.2e-7 apart.
TEST(CellWalk, DistinguishesVoxelsOfASmallDistantGrid) {
  const Size n{128, 128, 128};
  constexpr double kSide = 1e-3;
  Affine to_index;
  to_index.a = {128 / kSide, 0, 0, 0, 128 / kSide, 0, 0, 0, 128 / kSide};
  to_index.b = V3d(-.3, .4, .2) * (-128 / kSide) + V3d(-.5);
  const Grid g(n, random_values(n, 14, true), to_index, V3d(-.5), V3d(127.5), 1e5);
  std::mt19937 rng(3);
  // The rays are stored first: within one function, GCC 12 leaves out the rounding of a number that is
  // converted from double to float32 and back.
  std::vector<Ray> rays(300);
  for (Ray& r : rays) {
    const V3d at = V3d(-.3, .4, .2) + V3d(kSide / 2) + random_direction(rng) * (kSide / 4),
              away = random_direction(rng);
    r = {V3(at + away * 3.), V3(-away)};
  }
  int cells = 0;
  for (const auto& [o, d] : rays) {
    for (CellWalk w(g, o, d, 0, 6); w.next(); ++cells) {
      for (int k = 0; k <= 8; ++k) {
        const float t = w.begin() + (w.end() - w.begin()) * static_cast<float>(k) / 8;
        const V3d exact = to_index.point(V3d(o) + V3d(d) * (w.entry() + t)), off = V3d(w.index(t)) - exact;
        // Index coordinates up to 128, and distances along them, are each rounded by one unit in the last
        // place.
        ASSERT_LT(off.length(), 6 * 128 * 0x1p-23);
        ASSERT_LE(g.value<Lookup::trilinear>(w.index(t)), w.cell().hi);
        ASSERT_LE(std::abs(g.value<Lookup::trilinear>(w.index(t)) - w.cell().control), w.cell().residual);
      }
    }
  }
  EXPECT_GT(cells, 300 * 5);
}

TEST(CellWalk, IgnoresRaysThatAreNotFinite) {
  const Grid g = unit_grid({13, 14, 11}, random_values({13, 14, 11}, 2), 0, 10);
  const float nan = std::nanf(""), inf = std::numeric_limits<float>::infinity();
  const V3 o(6, 6, 6), d(0, 0, 1);
  for (int k = 0; k < 3; ++k) {
    for (const float bad : {nan, inf, -inf}) {
      V3 bad_o = o, bad_d = d;
      bad_o[k] = bad_d[k] = bad;
      EXPECT_FALSE(CellWalk(g, bad_o, d, 0, 100).next());
      EXPECT_FALSE(CellWalk(g, o, bad_d, 0, 100).next());
      EXPECT_FALSE(CellWalk(g, o, bad_d, 0, inf).next());
    }
  }
  EXPECT_FALSE(CellWalk(g, o, {0, 0, 0}, 0, inf).next());
  EXPECT_TRUE(CellWalk(g, o, d, 0, inf).next());
}

TEST(Grid, AnyCoordinatesReadWithinTheGrid) {
  const Size n{3, 4, 5};
  const float inf = std::numeric_limits<float>::infinity();
  for (const VolumeFilter filter : {kNearest, kTrilinear}) {
    const Grid g = voxel_grid(n, std::vector<float>(60, .25f), filter, Wrap::clamp);
    for (const float x : {std::nanf(""), inf, -inf, 1e30f, -1e30f}) {
      for (const V3& q : {V3(x, 1, 1), V3(1, x, 1), V3(1, 1, x), V3(x, x, x)}) {
        EXPECT_EQ(g.value_anywhere(q), .25f) << x;
      }
    }
  }
}

TEST(Grid, TransmittanceMatchesTheExactIntegral) {
  const Size n{13, 14, 11};
  for (const VolumeFilter filter : {kNearest, kTrilinear}) {
    const Grid g = voxel_grid(n, random_values(n, 3, true), filter, Wrap::clamp);
    for (const Ray& r : awkward_rays()) {
      if (std::abs(r.o.x) > 1e5f)
        continue;  // the exact integral cannot resolve the direction, even in double
      double sum = 0;
      for (CellWalk w(g, r.o, r.d, 0, 100); w.next();) {
        const Passage whole = g.pass(w.origin(), w.direction(), w.begin(), w.end());
        ASSERT_FALSE(whole.reached);
        sum += whole.integral;
        if (!(whole.integral > 1e-3)) continue;
        // The point up to which a third of the integral accumulates, checked by integrating up to it.
        const Passage third = g.pass(w.origin(), w.direction(), w.begin(), w.end(), whole.integral / 3);
        ASSERT_TRUE(third.reached);
        ASSERT_GE(third.t, w.begin());
        ASSERT_LE(third.t, w.end());
        const double up_to = g.pass(w.origin(), w.direction(), w.begin(), third.t).integral;
        // t is rounded to float32; values are below 1.
        ASSERT_NEAR(up_to, whole.integral / 3, 2e-6 * w.end());
      }
      // Float32 positions have an error of 2^-20 in an index, on each of up to 40 voxels with values below 1.
      ASSERT_NEAR(sum, exact_integral(g, V3d(r.o), V3d(r.d), 0, 100), 40 * 0x1p-20);
    }
  }
}

TEST(Grid, ConstantGridsNeedNoResidual) {
  const Grid g = unit_grid({9, 9, 9}, std::vector<float>(729, .7f));
  for (int x = 0; x < g.cells()[0]; ++x) EXPECT_EQ(g.cell(x, 0, 0).residual, 0.f);
}

}  // namespace
}  // namespace ls::render
