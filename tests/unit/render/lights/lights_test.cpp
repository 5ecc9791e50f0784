// Lights: the irradiance by their own sampling is compared with closed forms, and their densities with the
// samples.
#include "worker/render/lights/lights.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/unit/render/light_bench.h"

namespace ls::render {
namespace {

using test::SceneBuilder;
using test::operator*;
using test::scale;
using test::translate;

TEST(Lights, RectangleGivesLambertsIrradiance) {
  // Sums over the four corners of a rectangle of half sides a and b at height h. With A = a / h and B = b / h
  // a corner gives A / sqrt(1 + A^2) atan(B / sqrt(1 + A^2)), plus the same with A and B exchanged.
  const double a = .8 / 1.25, b = .5 / 1.25;
  const auto half = [](double p, double q) { return p / std::hypot(1, p) * std::atan(q / std::hypot(1, p)); };
  const LightBench bench(
      area(RectangleShape{}, translate({0, 0, 1.25}) * test::rotate_x(180) * test::scale(.8, .5, 1)));

  expect_close(bench.irradiance({0, 0, 0}, {0, 0, 1}), 2 * (half(a, b) + half(b, a)));
  EXPECT_EQ(bench.irradiance({0, 0, 3}, {0, 0, -1}).mean, 0) << "behind it";
}

TEST(Lights, DiskGivesPiSineSquared) {
  for (const double height : {.05, 1., 300.}) {
    const LightBench bench(area(DiskShape{}, translate({0, 0, height}) * test::rotate_x(180)));
    const auto e = bench.irradiance({0, 0, 0}, {0, 0, 1}, height < 1 ? 512 : 128);
    EXPECT_NEAR(e.mean, M_PI / (1 + height * height), 5 * e.se + M_PI / (1 + height * height) * 1e-5)
        << height;
  }
}

TEST(Lights, SphereGivesPiTimesTheSquareOfRadiusOverDistance) {
  for (const double distance : {1.01, 2., 100., 1e5}) {
    const LightBench bench(area(SphereShape{}, {}));
    // At a distance of 1e5 radii the directions span 1e-5. Their float32 rounding is 1e-2 of that, but
    // cancels in the mean.
    expect_close(bench.irradiance({0, 0, -distance}, {0, 0, 1}), M_PI / (distance * distance));
  }
}

TEST(Lights, IrradianceInsideAnEmittingSphereIsPi) {
  const LightBench bench(area(SphereShape{}, {}, true));
  // Directions are sampled uniformly, so the relative variance of the cosine, whose mean is 1/4, is 5/3.
  for (const V3d& x : {V3d(0, 0, 0), V3d(.3, -.5, .2), V3d(0, 0, -.999), V3d(0, 0, -1)}) {
    expect_close(bench.irradiance(x, {0, 0, 1}, 256), M_PI);
  }
}

TEST(Lights, MeshGivesTheIrradianceOfItsFaces) {
  // A cube of half side .5, whose lower face is 1 unit above the point; only that face points towards it.
  const LightBench bench(area(CubeShape{}, translate({0, 0, 1.5}) * test::scale(.5)));
  const double x = .5;
  const auto e = bench.irradiance({0, 0, 0}, {0, 0, 1}, 512);
  expect_close(e, 4 * x / std::hypot(1, x) * std::atan(x / std::hypot(1, x)));
}

TEST(Lights, SpotFallsOffLinearlyInTheAngle) {
  SceneBuilder builder;
  builder.shape(RectangleShape{}, {}, builder.diffuse(.5));
  builder.scene.emitters.push_back(SpotEmitter{{}, {2, 2, 2}, 30, 10, {}});
  const LightBench bench(builder);
  for (const double degrees : {0., 5., 9.9, 12., 20., 29., 31., 90.}) {
    const double a = degrees * M_PI / 180, share = std::clamp((30 - degrees) / 20, 0., 1.);
    const auto e =
        bench.irradiance({3 * std::sin(a), 0, 3 * std::cos(a)}, V3(-std::sin(a), 0, -std::cos(a)), 2);
    // The angle is the arc cosine of a float32, with an error of 2^-24 / sin(angle) relative to 20 degrees.
    EXPECT_NEAR(e.mean, 2. / 9 * share, 2. / 9 * 2e-6) << degrees;
  }
}

TEST(Lights, PointFollowsTheInverseSquareAtAllScales) {
  for (const double d : {1e-4, 1., 1e4}) {
    SceneBuilder builder;
    builder.shape(RectangleShape{}, test::scale(d), builder.diffuse(.5));
    builder.scene.emitters.push_back(PointEmitter{{0, 0, d}, {3, 3, 3}});
    const LightBench bench(builder);
    const double s = bench.world->geometry.scale;
    EXPECT_NEAR(bench.irradiance({0, 0, 0}, {0, 0, 1}, 2).mean, 3 / (d * d), 3 / (d * d) * 1e-6) << s;
  }
}

// pdf() of a hit equals the density of a sample at the same point.
TEST(Lights, HitAndSampleHaveTheSameDensity) {
  struct Named {
    const char* name;
    SceneBuilder builder;
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
      {"cylinder", area(CylinderShape{}, translate({0, 0, 3}) * test::rotate_x(70)), {.3, .2, -1}},
      {"inside of a cylinder", area(CylinderShape{}, {}, true), {.3, .2, .4}},
  };
  for (const Named& n : all) {
    const LightBench b(n.builder);
    const V3 x = b.at(n.x);
    const int hits =
        for_hits_of_samples(b, x, 2000, [&](const LightSample& s, const SurfaceHit& hit, float cosine) {
          ASSERT_NEAR(b.world->lights.pdf(hit, x, s.direction) / s.pdf, 1, 1e-4 / cosine) << n.name;
          ASSERT_EQ(b.world->lights.emitted(hit, -s.direction).x, 1.f) << n.name;
        });
    EXPECT_GT(hits, 300) << n.name;
  }
}

// A sphere with two colours in alternate quarters of azimuth and polar angle: from the plane of the equator
// or below a pole, equal parts of both colours are visible.
SceneBuilder checkered_sphere(bool flip) {
  SceneBuilder builder = area(SphereShape{}, {}, flip);
  const TextureIndex dark = builder.texture({.25, .25, .25}), bright = builder.texture({1.5, 1.5, 1.5});
  builder.scene.textures.push_back(CheckerboardTexture{dark, bright, {}});
  builder.scene.shapes[0].emitter->radiance = {static_cast<std::uint32_t>(builder.scene.textures.size() - 1)};
  return builder;
}

TEST(Lights, CheckeredSphereLightsWithTheMeanOfItsColours) {
  const LightBench outside(checkered_sphere(false)), inside(checkered_sphere(true));
  constexpr double kMean = (.25 + 1.5) / 2;
  expect_close(outside.irradiance({0, 0, -3}, {0, 0, 1}, 256), kMean * M_PI / 9);
  expect_close(outside.irradiance({0, 3, 0}, {0, -1, 0}, 256), kMean * M_PI / 9);
  expect_close(inside.irradiance({0, 0, 0}, {0, 1, 0}, 256), kMean * M_PI);
}

// As of a glTF material with emission and alphaMode MASK: of the card passes less than its alphaCutoff.
TEST(Lights, CutOutCardEmitsOnlyFromItsRemainingQuarter) {
  SceneBuilder builder = area(RectangleShape{}, translate({0, 0, 100}) * test::rotate_x(180));
  std::vector<Texture>& textures = builder.scene.textures;
  const auto add = [&](const Texture& t) {
    textures.push_back(t);
    return TextureIndex{static_cast<std::uint32_t>(textures.size() - 1)};
  };
  const TextureIndex one = add(ConstantTexture{{1, 1, 1}}), none = add(ConstantTexture{{0, 0, 0}}),
                     emission = add(ConstantTexture{{2, 2, 2}});
  UvTransform twice;
  twice.m[0] = twice.m[4] = 2;
  const TextureIndex half = add(CheckerboardTexture{one, none, twice}),
                     quarter = add(CheckerboardTexture{half, none, {}});
  const TextureIndex passed = add(ProductTexture{quarter, one, .5});
  builder.scene.shapes[0].emitter->radiance = add(ProductTexture{emission, passed});

  const LightBench bench(builder);

  EXPECT_EQ(bench.world->lights.left_out(), 0u);
  const auto e = bench.irradiance({0, 0, 0}, {0, 0, 1});
  EXPECT_NEAR(e.mean, .25 * 2 * 4 / 1e4, 5 * e.se + 1e-7);
}

TEST(Lights, SampleOfATexturedLightHasTheColourAtItsPoint) {
  for (const bool flip : {false, true}) {
    const LightBench b(checkered_sphere(flip));
    const V3 x = b.at(flip ? V3d(.3, -.2, .4) : V3d(1.5, -.9, .8));
    RandomStream r(9);
    int same = 0, count = 0;
    for (int i = 0; i < 2000; ++i) {
      const float u = r.uniform(), v = r.uniform();
      const auto s = b.world->lights.sample(b.world->lights.choose(numbers(0, u, v)), x);
      SurfaceHit hit;
      if (!s || !b.world->geometry.complete({PrimitiveId::Kind::sphere, 0}, x, s->direction, hit)) continue;
      ++count;
      same += s->radiance == b.world->lights.emitted(hit, -s->direction);
    }
    // Rounding may move a point, with a probability of 1e-6, across a border between the colours.
    EXPECT_GT(count, 1900);
    EXPECT_GE(same, count - 2);
  }
}

TEST(Lights, AreChosenWithTheirStatedProbability) {
  SceneBuilder builder = area(RectangleShape{}, {});
  constexpr int kLights = 20000;
  for (int i = 1; i < kLights; ++i) {
    const double power = 1 + i % 7;
    builder.scene.emitters.push_back(PointEmitter{{0, 0, 1. * i / kLights}, {power, power, power}});
  }
  const LightBench b(builder);
  const auto light_of = [&](std::uint64_t word) {
    return b.world->lights.choose({static_cast<std::uint32_t>(word), 0, 0}).light;
  };
  // Returns the first word of the next light.
  const auto end_of = [&](std::uint32_t light, std::uint64_t from) {
    std::uint64_t lo = from, hi = std::uint64_t{1} << 32;
    while (lo < hi) {
      const std::uint64_t mid = (lo + hi) / 2;
      if (light_of(mid) <= light) {
        lo = mid + 1;
      } else {
        hi = mid;
      }
    }
    return lo;
  };
  std::uint64_t word = 0;
  for (std::uint32_t i = 0; i < kLights; ++i) {
    const LightChoice c = b.world->lights.choose({static_cast<std::uint32_t>(word), 0, 0});
    ASSERT_EQ(c.light, i);
    const std::uint64_t end = end_of(i, word);
    ASSERT_FLOAT_EQ(c.probability, static_cast<float>(static_cast<double>(end - word) * 0x1p-32)) << i;
    word = end;
  }
  EXPECT_EQ(word, std::uint64_t{1} << 32);
}

// Each light reads the primitives of its own surface only: the ranges of all surfaces together have each
// primitive once, so the work is in proportion to shapes and triangles, not to their product.
TEST(Lights, ReadEachPrimitiveOnce) {
  SceneBuilder builder = area(RectangleShape{}, {});
  const Shape rectangle = builder.scene.shapes[0];
  Shape sphere = rectangle, disk = rectangle, cylinder = rectangle, cube = rectangle;
  sphere.geometry = SphereShape{};
  disk.geometry = DiskShape{};
  cylinder.geometry = CylinderShape{};
  cube.geometry = CubeShape{};
  builder.scene.shapes.clear();
  for (int i = 0; i < 50; ++i)
    for (Shape s : {rectangle, sphere, disk, cylinder, cube}) {
      s.to_world = translate({3. * i, 0, 0});
      builder.scene.shapes.push_back(s);
    }
  const auto geometry = Geometry::build(builder.scene, AssetLoader{builder.scene, builder.files});
  ASSERT_TRUE(geometry);

  const SurfacePrimitives primitives(*geometry);

  const auto expect_parts = [&](const std::vector<SurfacePrimitives::Range>& ranges, std::size_t all,
                                const auto& surface_of) {
    ASSERT_EQ(ranges.size(), geometry->surfaces.size());
    std::size_t count = 0;
    for (std::uint32_t surface = 0; surface < ranges.size(); ++surface) {
      const auto& range = ranges[surface];
      for (std::uint32_t i = 0; i < range.count; ++i)
        EXPECT_EQ(surface_of(range.first + i), surface) << range.first + i;
      count += range.count;
    }
    EXPECT_EQ(count, all);
  };
  const Geometry& g = *geometry;
  expect_parts(primitives.triangles, g.triangle_surface.size(),
               [&](auto i) { return g.triangle_surface[i]; });
  expect_parts(primitives.spheres, g.spheres.size(), [&](auto i) { return g.spheres[i].surface; });
  expect_parts(primitives.disks, g.disks.size(), [&](auto i) { return g.disks[i].surface; });
  expect_parts(primitives.cylinders, g.cylinders.size(), [&](auto i) { return g.cylinders[i].surface; });
}

TEST(Lights, DarkSideIsNeverSampledAndHasNoDensity) {
  const LightBench outside(area(SphereShape{}, {}, true)), inside(area(SphereShape{}, {}));
  SurfaceHit hit;
  const V3 from_out = outside.at({0, 0, -3}), from_in = inside.at({0, 0, .5});
  ASSERT_TRUE(outside.world->geometry.complete({PrimitiveId::Kind::sphere, 0}, from_out, {0, 0, 1}, hit));
  EXPECT_FALSE(outside.world->lights.sample(outside.world->lights.choose(numbers(0, .3f, .4f)), from_out));
  EXPECT_EQ(outside.world->lights.pdf(hit, from_out, {0, 0, 1}), 0.f);
  EXPECT_FALSE(inside.world->lights.sample(inside.world->lights.choose(numbers(0, .3f, .4f)), from_in));
  EXPECT_EQ(inside.world->lights.pdf(hit, from_in, {0, 0, 1}), 0.f);
}

TEST(Lights, AreVisibleOnlyFromTheirFront) {
  const LightBench bench(area(RectangleShape{}, {}));
  SurfaceHit hit;
  const V3 origin = bench.at({.1, .1, 2});
  const auto primitive = bench.world->accel.nearest(origin, {0, 0, -1}, kInfinity);
  ASSERT_TRUE(primitive && bench.world->geometry.complete(*primitive, origin, {0, 0, -1}, hit));

  EXPECT_FALSE(is_black(bench.world->lights.emitted(hit, {0, 0, 1})));
  EXPECT_TRUE(is_black(bench.world->lights.emitted(hit, {0, 0, -1})));
  EXPECT_TRUE(is_black(bench.world->lights.emitted(hit, {1, 0, 0}))) << "along the surface";
}

TEST(Lights, LightsWithoutPowerAreLeftOut) {
  SceneBuilder builder = area(RectangleShape{}, {});
  for (auto& texture : builder.scene.textures) texture = ConstantTexture{{0, 0, 0}};
  builder.scene.emitters.push_back(PointEmitter{{0, 0, 1}, {0, 0, 0}});
  const LightBench b(builder);
  EXPECT_FALSE(b.world->lights.can_sample());
  EXPECT_EQ(b.world->lights.left_out(), 2u);
}

// A lamp of half size `size` near the centre of a ball of radius 1 that encloses it.
SceneBuilder lamp_in_a_ball(const ls::Geometry& g, double size) {
  SceneBuilder builder;
  builder.lamp(g, translate({1e-4, -2e-4, 3e-5}) * test::rotate_x(33) * scale(size));
  builder.shape(SphereShape{}, {}, builder.diffuse(.5)).flip_normals = true;
  return builder;
}

V3 direction_of(RandomStream& r) {
  const float z = 2 * r.uniform() - 1;
  const V2 c = unit_circle(r.uniform());
  const float sine = std::sqrt(1 - z * z);
  return {sine * c.x, sine * c.y, z};
}

TEST(SmallLamp, IsNotHiddenByItself) {
  const ls::Geometry kinds[] = {RectangleShape{}, DiskShape{}, CubeShape{}, SphereShape{},
                                CylinderShape{{0, 0, -1}, {0, 0, 1}, .5}};
  for (const ls::Geometry& kind : kinds)
    for (const double size : {.2, .02, .001}) {
      const LightBench b(lamp_in_a_ball(kind, size));
      RandomStream r(3);
      int sampled = 0, hidden = 0;
      for (int i = 0; i < 20000; ++i) {
        const V3 x = direction_of(r) * (.9f * static_cast<float>(b.world->geometry.scale));
        const auto s =
            b.world->lights.sample(b.world->lights.choose(numbers(0, r.uniform(), r.uniform())), x);
        if (!s) continue;
        ++sampled;
        const V3 f = s->target - x;  // shadow rays are aimed at the target
        const float distance = std::sqrt(dot(f, f));
        hidden += b.world->accel.occluded(x, f / distance, distance) ? 1 : 0;
      }
      // Half of the points see only the back of a flat lamp
      EXPECT_GT(sampled, 5000) << kind.index() << ' ' << size;
      EXPECT_EQ(hidden, 0) << kind.index() << ' ' << size << " of " << sampled;
    }
}

}  // namespace
}  // namespace ls::render
