// Lights: irradiance by their own sampling against closed forms, and densities that agree with the sampling.
#include "worker/render/lights.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/render_check.h"
#include "worker/render/hash.h"
#include "worker/render/world.h"

namespace ls::render {
namespace {

using test::SceneKit;
using test::operator*;
using test::translate;

// A scene of one light; its world, and points given in scene coordinates.
struct Bench {
  std::shared_ptr<const World> world;
  explicit Bench(const SceneKit& kit) : world(test::world_of(kit)) {}
  V3 at(const V3d& p) const { return V3((p - world->geometry.center) * world->geometry.scale); }

  struct Irradiance {
    double mean, se;
  };
  // On a plane through x with normal n, over a stratified square of light samples.
  Irradiance irradiance(const V3d& x, const V3& n, int side = 128) const {
    RandomStream r(11);
    double sum = 0, square = 0;
    for (int i = 0; i < side * side; ++i) {
      const float u = (static_cast<float>(i % side) + r.uniform()) / static_cast<float>(side);
      const float v = (static_cast<float>(i / side) + r.uniform()) / static_cast<float>(side);
      const auto s = world->lights.sample(world->lights.choose(r.uniform(), {u, v}), at(x));
      const double e = s ? s->radiance.x * std::max(0.f, dot(n, s->direction)) / s->pdf : 0;
      sum += e;
      square += e * e;
    }
    const double count = double{1} * side * side, mean = sum / count;
    return {mean,
            std::sqrt(std::max(0., square / count - mean * mean) / count)};  // of unstratified samples: more
  }
};
SceneKit area(const ls::Geometry& g, const Transform& t, bool flip = false) {
  SceneKit kit;
  const TextureIndex one = kit.texture({1, 1, 1});
  const BsdfIndex black = kit.diffuse(0);
  Shape& s = kit.shape(g, t, black);
  s.emitter = AreaEmitter{one};
  s.flip_normals = flip;
  return kit;
}
// 5 standard errors of what independent samples would give, and float32 (the light's offset from its own
// surface: 2^-20 of the world).
void expect_close(const Bench::Irradiance& e, double expected) {
  EXPECT_NEAR(e.mean, expected, 5 * e.se + expected * 1e-5);
  EXPECT_LT(e.se, .02 * expected);
}

TEST(Lights, RectangleGivesLambertsIrradiance) {
  // Four corners of half sides a, b at height h: A/sqrt(1+A^2) atan(B/sqrt(1+A^2)) + the same with A, B
  // swapped.
  const double a = .8 / 1.25, b = .5 / 1.25;
  const auto half = [](double p, double q) { return p / std::hypot(1, p) * std::atan(q / std::hypot(1, p)); };
  const Bench bench(
      area(RectangleShape{}, translate({0, 0, 1.25}) * test::rotate_x(180) * test::scale(.8, .5, 1)));

  expect_close(bench.irradiance({0, 0, 0}, {0, 0, 1}), 2 * (half(a, b) + half(b, a)));
  EXPECT_EQ(bench.irradiance({0, 0, 3}, {0, 0, -1}).mean, 0) << "behind it";
}

TEST(Lights, DiskGivesPiSineSquared) {
  for (const double height : {.05, 1., 300.}) {
    const Bench bench(area(DiskShape{}, translate({0, 0, height}) * test::rotate_x(180)));
    const auto e = bench.irradiance({0, 0, 0}, {0, 0, 1}, height < 1 ? 512 : 128);
    EXPECT_NEAR(e.mean, M_PI / (1 + height * height), 5 * e.se + M_PI / (1 + height * height) * 1e-5)
        << height;
  }
}

TEST(Lights, SphereGivesPiTimesTheSquareOfRadiusOverDistance) {
  for (const double distance : {1.01, 2., 100., 1e5}) {
    const Bench bench(area(SphereShape{}, {}));
    // At 1e5 radii directions are 1e-5 apart: their float32 rounding is 1e-2 of that, but cancels in the
    // mean.
    expect_close(bench.irradiance({0, 0, -distance}, {0, 0, 1}), M_PI / (distance * distance));
  }
}

TEST(Lights, InsideAShiningSphereIrradianceIsPiEverywhere) {
  const Bench bench(area(SphereShape{}, {}, true));
  // Uniform directions: the cosine's relative variance is 5/3 of its mean 1/4.
  for (const V3d& x : {V3d(0, 0, 0), V3d(.3, -.5, .2), V3d(0, 0, -.999), V3d(0, 0, -1)}) {
    expect_close(bench.irradiance(x, {0, 0, 1}, 256), M_PI);
  }
}

TEST(Lights, MeshGivesTheIrradianceOfItsFaces) {
  // A cube of half side .5, its lower face 1 above: only that face is turned towards the point.
  const Bench bench(area(CubeShape{}, translate({0, 0, 1.5}) * test::scale(.5)));
  const double x = .5;
  const auto e = bench.irradiance({0, 0, 0}, {0, 0, 1}, 512);
  expect_close(e, 4 * x / std::hypot(1, x) * std::atan(x / std::hypot(1, x)));
}

TEST(Lights, SpotFallsOffLinearlyInTheAngle) {
  SceneKit kit;
  kit.shape(RectangleShape{}, {}, kit.diffuse(.5));
  kit.scene.emitters.push_back(SpotEmitter{{}, {2, 2, 2}, 30, 10, {}});
  const Bench bench(kit);
  for (const double degrees : {0., 5., 9.9, 12., 20., 29., 31., 90.}) {
    const double a = degrees * M_PI / 180, share = std::clamp((30 - degrees) / 20, 0., 1.);
    const auto e =
        bench.irradiance({3 * std::sin(a), 0, 3 * std::cos(a)}, V3(-std::sin(a), 0, -std::cos(a)), 2);
    // The angle is the arc cosine of a float32: 2^-24 / sin(angle) off, against 20 degrees.
    EXPECT_NEAR(e.mean, 2. / 9 * share, 2. / 9 * 2e-6) << degrees;
  }
}

TEST(Lights, PointFollowsTheInverseSquareAtAllScales) {
  for (const double d : {1e-4, 1., 1e4}) {
    SceneKit kit;
    kit.shape(RectangleShape{}, test::scale(d), kit.diffuse(.5));
    kit.scene.emitters.push_back(PointEmitter{{0, 0, d}, {3, 3, 3}});
    const Bench bench(kit);
    const double s = bench.world->geometry.scale;
    EXPECT_NEAR(bench.irradiance({0, 0, 0}, {0, 0, 1}, 2).mean, 3 / (d * d), 3 / (d * d) * 1e-6) << s;
  }
}

// The density that a hit claims is the one that a sample of the same point had.
TEST(Lights, DensityOfAHitIsThatOfItsSample) {
  struct Named {
    const char* name;
    SceneKit kit;
    V3d x;
  };
  const Named all[] = {
      {"rectangle", area(RectangleShape{}, translate({0, 0, 2}) * test::rotate_x(160)), {.3, .2, -1}},
      {"disk", area(DiskShape{}, translate({0, 0, 2}) * test::rotate_x(160)), {.3, .2, -1}},
      {"cube", area(CubeShape{}, translate({0, 0, 3})), {.3, .2, -1}},
      {"sphere", area(SphereShape{}, translate({0, 0, 3})), {.3, .2, -1}},
      {"distant sphere", area(SphereShape{}, translate({0, 0, 500})), {.3, .2, -1}},
      {"inside of a sphere", area(SphereShape{}, {}, true), {.3, .2, -.4}},
      {"inside of a cube", area(CubeShape{}, {}, true), {.3, .2, -.4}},
  };
  for (const Named& n : all) {
    const Bench b(n.kit);
    const V3 x = b.at(n.x);
    RandomStream r(5);
    int hits = 0;
    for (int i = 0; i < 2000; ++i) {
      const float u = r.uniform(), v = r.uniform();
      const auto s = b.world->lights.sample(b.world->lights.choose(0, {u, v}), x);
      if (!s) continue;
      const auto primitive = b.world->accel.nearest(x, s->direction, kInfinity);
      SurfaceHit hit;
      if (!primitive || !b.world->geometry.complete(*primitive, x, s->direction, hit)) continue;  // the rim
      if (std::abs(hit.t - s->distance) > 1e-4f * s->distance + 1e-5f) continue;  // another face in front
      const float cosine = std::abs(dot(hit.ng, s->direction));
      if (cosine < .05f) continue;  // grazing: the light's offset moves the point along it
      ++hits;
      ASSERT_NEAR(b.world->lights.pdf(hit, x, s->direction) / s->pdf, 1, 1e-4 / cosine) << n.name;
      ASSERT_EQ(b.world->lights.emitted(hit, -s->direction).x, 1.f) << n.name;
    }
    EXPECT_GT(hits, 300) << n.name;
  }
}

TEST(Lights, ADarkSideIsNeitherSampledNorGivenADensity) {
  const Bench outside(area(SphereShape{}, {}, true)), inside(area(SphereShape{}, {}));
  SurfaceHit hit;
  const V3 from_out = outside.at({0, 0, -3}), from_in = inside.at({0, 0, .5});
  ASSERT_TRUE(outside.world->geometry.complete({PrimitiveId::Kind::sphere, 0}, from_out, {0, 0, 1}, hit));
  EXPECT_FALSE(outside.world->lights.sample(outside.world->lights.choose(0, {.3f, .4f}), from_out));
  EXPECT_EQ(outside.world->lights.pdf(hit, from_out, {0, 0, 1}), 0.f);
  EXPECT_FALSE(inside.world->lights.sample(inside.world->lights.choose(0, {.3f, .4f}), from_in));
  EXPECT_EQ(inside.world->lights.pdf(hit, from_in, {0, 0, 1}), 0.f);
}

TEST(Lights, LightsWithoutPowerAreLeftOut) {
  SceneKit kit = area(RectangleShape{}, {});
  kit.scene.textures[0] = ConstantTexture{{0, 0, 0}};
  kit.scene.emitters.push_back(PointEmitter{{0, 0, 1}, {0, 0, 0}});
  const Bench b(kit);
  EXPECT_FALSE(b.world->lights.can_sample());
  EXPECT_EQ(b.world->lights.left_out(), 2u);
}

}  // namespace
}  // namespace ls::render
