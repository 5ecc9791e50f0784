// Area lights that shine on both sides.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/unit/render/light_bench.h"

namespace ls::render {
namespace {

using test::SceneBuilder;
using test::operator*;
using test::translate;

SceneBuilder two_sided(const ls::Geometry& g, const Transform& t, bool flip = false) {
  SceneBuilder builder = area(g, t, flip);
  builder.scene.shapes[0].emitter->two_sided = true;
  return builder;
}

// On its axis a disk of radius 1 gives pi / (1 + h^2), and a square of half side 1 gives
// 4 X / sqrt(1 + X^2) atan(X / sqrt(1 + X^2)) with X = 1 / h.
TEST(TwoSidedLight, GivesTheSameIrradianceOnBothSides) {
  for (const bool flip : {false, true})
    for (const double h : {2., -2., .5, -.5}) {
      const V3 down(0, 0, h > 0 ? -1 : 1);
      const double x = 1 / std::abs(h), root = std::hypot(1, x);

      expect_close(LightBench(two_sided(DiskShape{}, {}, flip)).irradiance({0, 0, h}, down),
                   M_PI / (1 + h * h));
      expect_close(LightBench(two_sided(RectangleShape{}, {}, flip)).irradiance({0, 0, h}, down),
                   4 * x / root * std::atan(x / root));
    }
}

// Inside a sphere of radius 1 the irradiance is pi, at the distance d outside it is pi / d^2.
TEST(TwoSidedLight, SphereEmitsInwardsAndOutwards) {
  const LightBench bench(two_sided(SphereShape{}, {}));

  for (const V3d& x : {V3d(0, 0, 0), V3d(.3, -.5, .2), V3d(0, 0, -.999), V3d(0, 0, -1)})
    expect_close(bench.irradiance(x, {0, 0, 1}, 256), M_PI);
  for (const double d : {1.5, 4.}) expect_close(bench.irradiance({0, 0, d}, {0, 0, -1}), M_PI / (d * d));
}

// A cylinder of radius 1 and length 2 h about the z axis, seen from its middle by a plane whose normal is
// along z. The upper half of the cylinder gives pi minus the share of the open end, a disk at height h: pi -
// pi / (1 + h^2).
TEST(TwoSidedLight, CylinderEmitsInwards) {
  const double h = 1.5;
  const LightBench bench(two_sided(CylinderShape{{0, 0, -h}, {0, 0, h}, 1}, {}));

  expect_close(bench.irradiance({0, 0, 0}, {0, 0, 1}, 512), M_PI - M_PI / (1 + h * h));
}

TEST(TwoSidedLight, HitHasTheRadianceAndDensityOfItsSample) {
  const Transform turned = test::rotate_x(170);
  const ls::Geometry kinds[] = {RectangleShape{}, DiskShape{}, CubeShape{}, SphereShape{},
                                CylinderShape{{0, 0, -1}, {0, 0, 1}, .5}};
  for (const ls::Geometry& g : kinds)
    for (const V3d& place : {V3d(.3, .2, -4), V3d(.3, .2, 4), V3d(.1, .2, -.3)}) {
      const LightBench b(two_sided(g, turned));
      const V3 x = b.at(place);
      const int hits =
          for_hits_of_samples(b, x, 4000, [&](const LightSample& s, const SurfaceHit& hit, float cosine) {
            ASSERT_EQ(b.world->lights.emitted(hit, -s.direction), s.radiance) << g.index();
            // Cosines are accurate to 2^-20 of the world's size over a length of 1/100 of it.
            ASSERT_NEAR(b.world->lights.pdf(hit, x, s.direction) / s.pdf, 1, 1e-4 / cosine) << g.index();
          });
      EXPECT_GT(hits, 300) << g.index() << " " << place.z;
    }
}

// From outside only the near wall is sampled.
TEST(TwoSidedLight, FarWallOfASphereIsFoundOnlyBySampledDirections) {
  for (const bool flip : {false, true}) {
    const LightBench b(two_sided(SphereShape{}, {}, flip));
    const V3 outside = b.at({0, 0, 3}), inside = b.at({0, 0, 0}), down(0, 0, -1);
    SurfaceHit near, far;
    ASSERT_TRUE(
        b.world->geometry.complete(*b.world->accel.nearest(outside, down, kInfinity), outside, down, near));
    ASSERT_TRUE(
        b.world->geometry.complete(*b.world->accel.nearest(inside, down, kInfinity), inside, down, far));

    EXPECT_GT(b.world->lights.pdf(near, outside, down), 0);
    EXPECT_EQ(b.world->lights.pdf(far, outside, down), 0);
    EXPECT_GT(b.world->lights.pdf(far, inside, down), 0);
    EXPECT_EQ(b.world->lights.emitted(far, -down).x, 1);
  }
}

// A floor of albedo 1/2 lies under a sphere of radius 1/2 at height 4 that lets light through. Each ray
// towards the sphere meets its near wall and its far wall, so the irradiance is 2 pi (r / d)^2, and the
// radiance is half of that over pi.
TEST(TwoSidedLight, BothWallsOfAClearSphereLightTheFloor) {
  SceneBuilder builder({1, 1});
  Shape& lamp = builder.lamp(SphereShape{}, translate({0, 0, 4}) * test::scale(.5));
  lamp.emitter->two_sided = true;
  lamp.bsdf = builder.bsdf(NullBsdf{});
  builder.shape(RectangleShape{}, {}, builder.diffuse(.5));
  builder.look({3, 0, 1}, {0, 0, 0}, .2);

  const test::Estimate e = test::estimate(builder, 1 << 16);

  // The field of view of 0.2 degrees covers 0.006 units of the floor, over which the irradiance changes by
  // (0.006 / 4)^2
  EXPECT_NEAR(e.mean[0], 1. / 64, 5 * e.standard_error[0] + 1e-5 / 64);
  EXPECT_LT(e.standard_error[0], .01 / 64);
}

TEST(TwoSidedLight, OnlyItsOwnBackEmits) {
  SceneBuilder builder = two_sided(RectangleShape{}, {});
  builder.lamp(RectangleShape{}, translate({5, 0, 0}));
  const LightBench b(builder);
  for (const double x : {0., 5.})
    for (const float way : {1.f, -1.f}) {
      const V3 from = b.at({x + .1, .2, 3. * double{way}}), d(0, 0, -way);
      const auto primitive = b.world->accel.nearest(from, d, kInfinity);
      SurfaceHit hit;
      ASSERT_TRUE(primitive && b.world->geometry.complete(*primitive, from, d, hit));
      EXPECT_EQ(b.world->lights.emitted(hit, -d).x, x == 5 && way < 0 ? 0 : 1) << x << " " << way;
    }
}

// Two lights have the same area and radiance, and one of them shines on both sides. That one is chosen with
// the probability 1/2 * 2/3 + 1/2 * 1/2 = 7/12.
TEST(TwoSidedLight, HasThePowerOfTwo) {
  SceneBuilder builder = two_sided(RectangleShape{}, {});
  builder.lamp(RectangleShape{}, translate({5, 0, 0}));
  const LightBench b(builder);

  EXPECT_NEAR(b.world->lights.choose(numbers(0, 0, 0)).probability, 7. / 12, 1e-6);
}

// Beams of 30 degrees to both sides: each has sin^2 30 of the flux pi of a plain light.
TEST(TwoSidedLight, BeamEmitsBothWays) {
  SceneBuilder builder = two_sided(RectangleShape{}, test::scale(.5));
  builder.scene.shapes[0].emitter->cutoff_angle = builder.scene.shapes[0].emitter->beam_width = 30;
  const LightBench b(builder);
  for (const double degrees : {5., 29., 31., 149., 151., 175.}) {
    const double a = degrees * M_PI / 180, d = 1000;
    const V3 towards(std::sin(a), 0, std::cos(a));
    const double lit = degrees < 30 || degrees > 150 ? std::abs(std::cos(a)) / (d * d) : 0;
    // From that distance the light is 1 / 1000 rad wide.
    EXPECT_NEAR(b.irradiance(V3d(towards) * d, -towards, 32).mean, lit, 2e-3 / (d * d)) << degrees;
  }
}

// 40 two-sided lights in a plane, chosen by the tree, and 20 faint ones that only shine down. The irradiance
// on each side is the sum of those of the lights that shine there.
TEST(TwoSidedLight, LightTreeFindsThemFromBehind) {
  SceneBuilder builder;
  constexpr double kSize = .05, kHeight = 3, kFaint = .01;
  double of_all = 0, of_faint = 0;
  for (int i = 0; i < 60; ++i) {
    const bool faint = i >= 40;
    const double x = .3 * (i % 8) - 1, y = .3 * (i / 8) - .6;
    const Transform at = translate({x, y, 0}) * test::scale(kSize);
    if (faint)
      builder.lamp(RectangleShape{}, at, {kFaint, kFaint, kFaint}).flip_normals = true;
    else
      builder.lamp(RectangleShape{}, at).emitter->two_sided = true;
    // A small light gives L A cos^2 / d^2, with a relative error of at most (size / d)^2 = 3e-4.
    const double d2 = x * x + y * y + kHeight * kHeight,
                 e = 4 * kSize * kSize * kHeight * kHeight / (d2 * d2);
    (faint ? of_faint : of_all) += e * (faint ? kFaint : 1);
  }
  const LightBench b(builder);
  ASSERT_TRUE(b.world->lights.has_tree());
  for (const float side : {1.f, -1.f}) {
    const V3 x = b.at({0, 0, kHeight * double{side}}), n(0, 0, -side);
    const double expected = of_all + (side < 0 ? of_faint : 0);
    RandomStream r(3);
    double sum = 0, square = 0;
    constexpr int kN = 20000;
    for (int i = 0; i < kN; ++i) {
      const LightNumbers words{static_cast<std::uint32_t>(r.uniform() * 0x1p32), 0x80000000u, 0x80000000u};
      const auto c = b.world->lights.choose(words, {x, n});
      const auto s = b.world->lights.sample(c, x);
      const double e = s ? double{s->radiance.x * std::max(0.f, dot(n, s->direction)) / s->pdf} : 0;
      sum += e / kN;
      square += e * e / kN;
    }
    const double deviation = std::sqrt(square - sum * sum);
    EXPECT_NEAR(sum, expected, 5 * deviation / std::sqrt(kN) + 1e-3 * expected) << side;
    // A tree that considered only the fronts would choose the faint lights from behind, and find the others
    // only by the 1/16 of the words that use the table: the deviation would be four times the mean.
    EXPECT_LT(deviation, sum) << side;
  }
}

}  // namespace
}  // namespace ls::render
