// Rays that start on surfaces: small closed shapes in huge scenes let none escape.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "tests/support/render_check.h"
#include "worker/render/world/world.h"

namespace ls::render {
namespace {

using test::SceneBuilder;
using test::translate;
using test::operator*;

V3 random_direction(std::mt19937& rng) {
  std::normal_distribution<double> n;
  const double x = n(rng), y = n(rng), z = n(rng);
  return V3(V3d(x, y, z).normalized());
}

// Lets a path of `rays` rays bounce inside the closed shapes around `center` (in scene units). Returns how
// many rays meet nothing or one of the surfaces from `others` on.
std::uint64_t leaks(const World& w, const V3d& center, std::uint32_t others, int rays, unsigned seed) {
  const V3 middle((center - w.geometry.center) * w.geometry.scale);
  std::mt19937 rng(seed);
  std::uint64_t lost = 0;
  V3 o = middle, d = random_direction(rng);
  for (int i = 0; i < rays; ++i) {
    const auto primitive = w.accel.nearest(o, d, kInfinity);
    SurfaceHit hit;
    if (!primitive || !w.geometry.complete(*primitive, o, d, hit) || hit.surface >= others) {
      ++lost;
      o = middle;
      continue;
    }
    d = random_direction(rng);
    // These shapes are star-shaped: d is turned inwards.
    if (dot(d, hit.ng) * dot(hit.ng, hit.p - middle) > 0) d = -d;
    o = offset_point(hit, d);
  }
  return lost;
}

// A box of size 1e-4 in a scene of size 1e6. The centre of the world is that of the scene, so boxes near it
// have small coordinates: their size is at least 1e-4 / 2 of their largest coordinate, about 800 times
// float32's resolution of 2^-24.
TEST(Offsets, ScaleWithTheSurface) {
  const Transform turn = test::rotate_x(33) * test::rotate_y(21);
  for (const V3d& at : {V3d(0, 0, 0), V3d(.3, -.2, .1), V3d(2, 1, -1)})
    for (const ls::Geometry& shape : {ls::Geometry{CubeShape{}}, ls::Geometry{SphereShape{}}}) {
      SceneBuilder builder;
      const Vec3 place{at.x, at.y, at.z};
      builder.shape(shape, translate(place) * turn * test::scale(.5e-4), builder.diffuse(.5));
      builder.shape(SphereShape{}, test::scale(1e6), builder.diffuse(.5));
      EXPECT_EQ(leaks(*test::world_of(builder), at, 1, 100000, 1), 0u) << at << ' ' << shape.index();
    }
}

// In a closed grey box that emits light the radiance is Le / (1 - .5), for sizes from 1e-4 to 1e6, alone and
// next to something huge.
TEST(Offsets, PreserveTheLightOfAFurnace) {
  for (const double size : {1e-4, 1., 1e6})
    for (const double beside : {0., 1e6}) {
      SceneBuilder builder({4, 4});
      const TextureIndex light = builder.texture({1, 1, 1});
      builder
          .shape(CubeShape{}, test::rotate_x(33) * test::rotate_y(21) * test::scale(size),
                 builder.diffuse(.5))
          .emitter = AreaEmitter{light};
      builder.scene.shapes.back().flip_normals = true;
      if (beside > 0)
        builder.shape(SphereShape{}, translate({3 * size, 0, 0}) * test::scale(beside), builder.diffuse(0));
      builder.look({0, 0, 0}, {size, 0, 0}, 90);
      builder.scene.sensor.near_clip = 1e-3 * size;
      const auto e = test::estimate(builder, 256);
      EXPECT_NEAR(e.mean[0], 2, 5 * e.standard_error[0] + 1e-3) << size << ' ' << beside;
      EXPECT_LT(e.standard_error[0], .01);
    }
}

// Instances are traced in their group's space. These are stretched, turned and mirrored as far as single
// precision allows.
TEST(Offsets, HoldInStretchedAndMirroredInstances) {
  const Transform turn = test::rotate_x(40) * test::rotate_y(-25);
  for (const Vec3& s :
       {Vec3{1, 1, 1}, Vec3{-1, 1, 1}, Vec3{1e-3, 1, 1e3}, Vec3{1e-4, 1, -1e4}, Vec3{1e-4, 1e-4, 1e-4}})
    for (const bool turned : {false, true})
      for (const bool away : {false, true}) {
        SceneBuilder builder;
        const auto group = SceneBuilder::push<GroupTag>(builder.scene.groups, ShapeGroup{});
        builder.shape(CubeShape{}, turn, builder.diffuse(.5)).group = group;
        const Vec3 place = away ? Vec3{3, -2, 1} : Vec3{0, 0, 0};
        builder.scene.instances.push_back(
            {group, translate(place) * (turned ? turn : Transform{}) * test::scale(s[0], s[1], s[2])});
        const auto w = test::world_of(builder);
        EXPECT_EQ(leaks(*w, {place[0], place[1], place[2]}, 1, 20000, 3), 0u)
            << s[0] << ' ' << s[1] << ' ' << s[2] << ' ' << turned << away;
      }
}

// Instances whose transform has no inverse, or that are too flat, compared with the world, for tracing in
// single precision (docs/measurements/stability.md N44).
TEST(Offsets, RefuseInstancesThatAreTooFlat) {
  for (const Vec3& s : {Vec3{0, 1, 1}, Vec3{1e-30, 1e-30, 1e-30}, Vec3{1e-6, 1, 1e6}}) {
    SceneBuilder builder;
    const auto group = SceneBuilder::push<GroupTag>(builder.scene.groups, ShapeGroup{});
    builder.shape(CubeShape{}, {}, builder.diffuse(.5)).group = group;
    builder.scene.instances.push_back({group, test::scale(s[0], s[1], s[2])});
    builder.shape(CubeShape{}, {}, builder.diffuse(.5));
    EXPECT_THROW(test::world_of(builder), std::runtime_error) << s[0];
  }
}

}  // namespace
}  // namespace ls::render
