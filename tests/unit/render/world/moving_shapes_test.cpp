// Shapes that move: what rays meet at each time of the exposure, and a closed form.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "core/scene/motion.h"
#include "tests/support/render_check.h"
#include "tests/support/significance.h"
#include "tests/unit/render/hits.h"
#include "worker/render/geometry/moment.h"

namespace ls::render {
namespace {

using test::rotate_x;
using test::rotate_y;
using test::scale;
using test::SceneBuilder;
using test::translate;
using test::operator*;
using testing::HasSubstr;

template <class T>
void let_move(T& object, const std::vector<MotionKey>& keys) {
  object.motion = keys;
  object.to_world = scene::Motion(keys).at(.5);
}

const std::vector<MotionKey> kTumble{{0, translate({-3, 1, 2}) * rotate_y(20) * scale(.5)},
                                     {.3, translate({1, -1, 0}) * rotate_x(100) * scale(.5)},
                                     {1, translate({2, 2, -1}) * rotate_x(170) * rotate_y(80) * scale(.8)}};

// One shape of each kind that moves, before a wall that stands still.
SceneBuilder with_moving(const ls::Geometry& kind) {
  SceneBuilder b;
  const BsdfIndex material = brushed(b);
  b.shape(RectangleShape{}, translate({0, 0, -4}) * scale(6), material);
  let_move(b.shape(kind, {}, material), kTumble);
  b.scene.sensor.shutter_close = 1;
  return b;
}
SceneBuilder stopped(SceneBuilder b, double time) {
  for (Shape& s : b.scene.shapes) {
    if (!s.motion.empty()) s.to_world = scene::Motion(s.motion).at(time);
    s.motion.clear();
  }
  b.scene.sensor.shutter_close = 0;
  return b;
}

TEST(MovingShapes, AreWhereStillOnesWouldBeAtEachTime) {
  struct Kind {
    const char* name;
    ls::Geometry geometry;
  };
  for (const auto& [name, geometry] :
       {Kind{"rectangle", RectangleShape{}}, Kind{"cube", CubeShape{}}, Kind{"sphere", SphereShape{}},
        Kind{"disk", DiskShape{}}, Kind{"cylinder", CylinderShape{}}}) {
    const SceneBuilder moving = with_moving(geometry);
    const auto world = test::world_of(moving);
    int met = 0, differ = 0;
    for (const double time : {0., .125, .25, .3125, .5, .75, .9375, 1.}) {
      const auto still = test::world_of(stopped(moving, time));
      const Moment moment(world->geometry, static_cast<float>(time));
      std::mt19937 rng(7);
      std::uniform_real_distribution<double> place(-1, 1);
      for (int i = 0; i < 4000; ++i) {
        const double x = place(rng), y = place(rng), z = place(rng), u = place(rng), v = place(rng),
                     w = place(rng);
        const V3d from(6 * x, 6 * y, 6 * z),
            to = V3d(scene::Motion(kTumble).at(time).m[3], scene::Motion(kTumble).at(time).m[7],
                     scene::Motion(kTumble).at(time).m[11]) +
                 V3d(u, v, w),
            d = (to - from).normalized();
        const auto in = [&](const World& a) { return V3((from - a.geometry.center) * a.geometry.scale); };
        SurfaceHit here, there;
        const auto a = world->accel.nearest(in(*world), V3(d), kInfinity, moment),
                   b = still->accel.nearest(in(*still), V3(d), kInfinity);
        const bool ha = a && world->geometry.complete(*a, in(*world), V3(d), moment, here),
                   hb = b && still->geometry.complete(*b, in(*still), V3(d), there);
        ASSERT_EQ(a.has_value(), ha) << name << ": the BVH found a hit that complete() does not find";
        const V3d p = V3d(here.p) / world->geometry.scale + world->geometry.center,
                  q = V3d(there.p) / still->geometry.scale + still->geometry.center;
        // At edges and silhouettes rounding may lead to different hits.
        if (ha != hb || (ha && (here.surface != there.surface || (p - q).length() > 1e-3))) {
          ++differ;
          continue;
        }
        if (!ha || here.surface == 0) continue;
        ++met;
        const float grazing = std::max(.02f, std::abs(dot(there.ng, V3(d))));
        // Tens of float32 roundings of coordinates up to 10
        ASSERT_LT((p - q).length(), 4e-5 / grazing) << name;
        ASSERT_GT(dot(here.ng, there.ng), 1 - 1e-5f / grazing) << name;
        ASSERT_GT(dot(here.shading.s, there.shading.s), .999f) << name;
        ASSERT_LT((here.uv - there.uv).length(), 1e-3f / grazing) << name;
        ASSERT_TRUE(world->accel.occluded(in(*world), V3(d), here.t * 1.01f, moment)) << name;
        ASSERT_FALSE(world->accel.occluded(in(*world), V3(d), here.t * .99f, moment)) << name;
      }
    }
    EXPECT_GT(met, 4000) << name;
    EXPECT_LT(differ, 40) << name;
  }
}

// The boxes by which the BVH finds a moving instance hold it at all times, also between keys.
TEST(MovingShapes, StayInTheirBoxes) {
  std::mt19937 rng(3);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform;
  const auto pose = [&] {
    const double x = normal(rng), y = normal(rng), z = normal(rng), a = 360 * uniform(rng),
                 b = 360 * uniform(rng), s = .1 + uniform(rng), t = .1 + uniform(rng);
    return translate({x, y, z}) * rotate_x(a) * rotate_y(b) * scale(s, t, 1);
  };
  for (int i = 0; i < 200; ++i) {
    std::vector<MotionKey> keys{{0, pose()}, {.1 + .8 * uniform(rng), pose()}, {1, pose()}};
    const MovingInstance moving(scene::Motion(keys), Affine(pose()), V3d(.5, 1, 2), .25);
    const Box box{{-1, -.5, -.2}, {.5, 1, .3}};
    const double from = uniform(rng), to = from + (1 - from) * uniform(rng);
    const Box during = moving.box(box, from, to);
    for (int k = 0; k <= 64; ++k) {
      const Box there = box.moved(moving.to_world(from + (to - from) * k / 64));
      for (int c = 0; c < 3; ++c) {
        ASSERT_GE(there.lo[c], during.lo[c] - 1e-12);  // 1e-12: thousands of roundings of numbers below 10
        ASSERT_LE(there.hi[c], during.hi[c] + 1e-12);
      }
    }
    EXPECT_GE(moving.parts(box), 1u);
    EXPECT_LE(moving.parts(box), MovingInstance::kMostParts);
  }
}

TEST(MovingShapes, BoxesOfStraightWaysAreTight) {
  const std::vector<MotionKey> keys{{0, Transform{}}, {1, translate({8, 0, 0})}};
  const MovingInstance moving(scene::Motion(keys), Affine(), V3d(0), 1);
  const Box box{{-1, -1, -1}, {1, 1, 1}}, half = moving.box(box, .25, .5);
  EXPECT_NEAR(half.lo.x, 1, 1e-12);
  EXPECT_NEAR(half.hi.x, 5, 1e-12);
  EXPECT_NEAR(half.hi.y, 1, 1e-12);
  EXPECT_EQ(moving.parts(box), 19u);  // 8 over an eighth of the diagonal, 2 sqrt(3)
}

// A black slab that moves sideways before a shining background. At x the slab is in the way for the share of
// the time in which its left edge is from x - width to x: a trapezoid, whose corners lie between pixels here.
TEST(MovingShapes, ASlabThatPassesGivesATrapezoid) {
  constexpr int kPixels = 16;
  constexpr std::uint64_t kSpp = 256;
  constexpr double kWidth = .5, kStart = -.75, kWay = .75;
  SceneBuilder b(FrameSize{kPixels, 1});
  b.environment(1);
  const auto slab = [&](double left) {
    return translate({left + kWidth / 2, 0, 1}) * rotate_y(180) * scale(kWidth / 2, 5, 1);
  };
  let_move(b.shape(RectangleShape{}, {}, b.diffuse(0)), {{0, slab(kStart)}, {1, slab(kStart + kWay)}});
  Sensor& s = b.scene.sensor;
  s.projection = Projection::orthographic;
  s.shutter_close = 1;
  const auto world = test::world_of(b);
  const auto sums = render_tile(*world, {0, 0, kPixels, 1}, {0, kSpp}, nullptr, nullptr).sums;
  for (int i = 0; i < kPixels; ++i) {
    const double seen =
        double{sums[static_cast<std::size_t>(i)] + sums[static_cast<std::size_t>(3 * kPixels + i)]} / kSpp;
    const double x = 1 - (i + .5) * 2 / kPixels;  // the camera's +x points to the left
    const double hidden = std::max(0., std::min(x, kStart + kWay) - std::max(x - kWidth, kStart)) / kWay;
    // The variance of a share of independent samples bounds that of a low-discrepancy sequence here.
    const double error = std::sqrt(hidden * (1 - hidden) / kSpp);
    EXPECT_NEAR(seen, 1 - hidden, test::kStandardErrors * error) << "pixel " << i;
  }
}

TEST(MovingShapes, DoNotDependOnTilesOrThreads) {
  SceneBuilder b = with_moving(CubeShape{});
  b.environment(1);
  b.scene.sensor.to_world = test::look_at({0, 0, 8}, {0, 0, 0}, {0, 1, 0});
  const auto one = test::world_of(b, 1, 1), two = test::world_of(b, 1, 2);
  const auto whole = render_tile(*one, {0, 0, 16, 16}, {0, 4}, nullptr, nullptr).sums,
             part = render_tile(*two, {5, 9, 8, 11}, {0, 4}, nullptr, nullptr).sums;
  for (std::size_t plane = 0; plane < 6; ++plane)
    for (std::size_t y = 0; y < 2; ++y)
      for (std::size_t x = 0; x < 3; ++x)
        EXPECT_EQ(part[plane * 6 + y * 3 + x], whole[plane * 256 + (9 + y) * 16 + 5 + x]);
}

TEST(MovingShapes, TakeAVariantOfTheirOwnAndLeaveOutWhatJoinsTimes) {
  SceneBuilder b = with_moving(SphereShape{});
  b.environment(1);
  b.scene.integrator.path_reuse = 8;
  b.scene.integrator.sky_portals = 1;
  b.scene.emitters.push_back(DirectionalEmitter{{.3, -1, .2}, {1, 1, 1}});
  b.scene.integrator.light_vertices = 1;
  b.scene.integrator.local_lights = 1;
  const auto world = test::world_of(b);
  EXPECT_THAT(describe(*world).variant, HasSubstr("surfaces that move"));
  for (const Technique t :
       {Technique::path_reuse, Technique::light_vertices, Technique::sky_portals, Technique::local_lights})
    EXPECT_FALSE(techniques_of(*world).has(t)) << static_cast<int>(t);
}

TEST(MovingShapes, EveryVariantThatCoversThemGivesTheSameBits) {
  for (const char* integrator : {"volpath", "volpath_distant_mis", "whitted"}) {
    SceneBuilder b = with_moving(CubeShape{});
    b.environment(1);
    b.scene.integrator.name = integrator;
    b.scene.sensor.to_world = test::look_at({0, 0, 8}, {0, 0, 0}, {0, 1, 0});
    const auto world = test::world_of(b);
    const auto first = render_tile(*world, {0, 0, 16, 16}, {0, 8}, nullptr, nullptr).sums;
    for (const std::string& name : covering_variants(*world))
      EXPECT_EQ(render_tile_as(*world, name, {0, 0, 16, 16}, {0, 8}).sums, first) << integrator << name;
  }
}

TEST(MovingShapes, BoundariesThatPassTheCameraAreRefused) {
  SceneBuilder b;
  const MediumIndex fog = b.homogeneous({1, 1, 1}, {.5, .5, .5});
  let_move(b.container(SphereShape{}, {}, b.null(), fog),
           {{0, translate({-3, 0, 0})}, {1, translate({3, .2, 0})}});
  b.scene.sensor.shutter_close = 1;
  const auto build = [&] { return build_world(b.scene, test::settings_of(b.scene), b.files, 1); };
  const auto passed = build();
  ASSERT_FALSE(passed);
  EXPECT_THAT(passed.error().message, HasSubstr("moves over the camera while the shutter is open"));
  b.scene.sensor.to_world = translate({0, 5, 0});
  EXPECT_TRUE(build());
  // A camera that stays inside is in the medium of its sensor at all times.
  b.scene.sensor.to_world = Transform{};
  b.scene.sensor.medium = fog;
  let_move(b.scene.shapes[0], {{0, translate({-.3, 0, 0})}, {1, translate({.3, .2, 0})}});
  EXPECT_TRUE(build());
}

}  // namespace
}  // namespace ls::render
