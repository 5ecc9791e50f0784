// Instances of groups are compared with the same shapes placed directly: hits of rays, and light.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "tests/support/render_check.h"
#include "tests/unit/render/hits.h"

namespace ls::render {
namespace {

using test::SceneBuilder;
using test::translate;
using test::operator*;
using testing::HasSubstr;

// A bumpy sheet with vertex normals, as an OBJ file.
MeshShape sheet(SceneBuilder& builder) {
  std::string text;
  constexpr int kSide = 6;
  for (int y = 0; y <= kSide; ++y)
    for (int x = 0; x <= kSide; ++x) {
      const double u = 2. * x / kSide - 1, v = 2. * y / kSide - 1;
      text += "v " + std::to_string(u) + " " + std::to_string(v) + " " +
              std::to_string(.2 * std::sin(3 * u + 2 * v)) + "\nvt " + std::to_string(u + .3 * v) + " " +
              std::to_string(v) + "\nvn " + std::to_string(-.6 * std::cos(3 * u + 2 * v)) + " " +
              std::to_string(-.4 * std::cos(3 * u + 2 * v)) + " 1\n";
    }
  for (int y = 0; y < kSide; ++y)
    for (int x = 0; x < kSide; ++x) {
      const int a = y * (kSide + 1) + x + 1, b = a + 1, c = a + kSide + 1, d = c + 1;
      for (const auto& t : {std::array{a, b, c}, std::array{b, d, c}}) {
        text += "f";
        for (const int i : t)
          text += " " + std::to_string(i) + "/" + std::to_string(i) + "/" + std::to_string(i);
        text += "\n";
      }
    }
  MeshShape mesh;
  mesh.file = builder.asset("sheet.obj", text);
  return mesh;
}

// Makes the shapes of `builder` a group with one instance for each transform.
SceneBuilder instanced(SceneBuilder builder, const std::vector<Transform>& places) {
  const auto group = SceneBuilder::push<GroupTag>(builder.scene.groups, ShapeGroup{});
  for (Shape& s : builder.scene.shapes) s.group = group;
  for (const Transform& t : places) builder.scene.instances.push_back({group, t});
  return builder;
}
SceneBuilder copied(SceneBuilder builder, const std::vector<Transform>& places) {
  const std::vector<Shape> shapes = std::exchange(builder.scene.shapes, {});
  for (const Transform& t : places)
    for (Shape s : shapes) {
      s.to_world = t * s.to_world;
      builder.scene.shapes.push_back(s);
    }
  return builder;
}

struct Met {
  bool any = false;
  V3d p;  // in scene coordinates
  SurfaceHit hit;
};
Met meet(const World& w, const V3d& from, const V3d& d) {
  const V3 o((from - w.geometry.center) * w.geometry.scale);
  Met m;
  const auto primitive = w.accel.nearest(o, V3(d), kInfinity);
  m.any = primitive && w.geometry.complete(*primitive, o, V3(d), m.hit);
  m.p = V3d(m.hit.p) / w.geometry.scale + w.geometry.center;
  return m;
}

// Traces rays from all around in both worlds and compares the hits. `bend` is the largest allowed 1 - cos
// between shading normals: if a map stretches, normals interpolated before it and after it differ.
void expect_alike(const SceneBuilder& a, const SceneBuilder& b, const char* name, float bend = 1e-5f) {
  // The tolerance of positions relative to the world's size: tens of float32 roundings
  constexpr double tolerance = 4e-6;
  const auto wa = test::world_of(a), wb = test::world_of(b);
  std::mt19937 rng(5);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform(-1, 1);
  const double size = 1 / wb->geometry.scale;
  int hits = 0, differ = 0;
  for (int i = 0; i < 20000; ++i) {
    const double x = normal(rng), y = normal(rng), z = normal(rng);
    const double tx = uniform(rng), ty = uniform(rng), tz = uniform(rng);
    const V3d from = wb->geometry.center + V3d(x, y, z).normalized() * (3 * size),
              to = wb->geometry.center + V3d(tx, ty, tz) * (.7 * size), d = (to - from).normalized();
    const Met ma = meet(*wa, from, d), mb = meet(*wb, from, d);
    // At silhouettes and edges rounding may lead to different hits.
    if (ma.any != mb.any || (ma.any && (ma.p - mb.p).length() > 1e-3 * size)) {
      ++differ;
      continue;
    }
    if (!ma.any) continue;
    const float grazing = std::max(.02f, std::abs(dot(mb.hit.ng, V3(d))));
    ++hits;
    ASSERT_LT((ma.p - mb.p).length(), tolerance * size / grazing) << name;
    ASSERT_GT(dot(ma.hit.ng, mb.hit.ng), 1 - 1e-5f / grazing) << name << ma.hit.ng << mb.hit.ng;
    ASSERT_GT(dot(ma.hit.shading.n, mb.hit.shading.n), 1 - bend / grazing) << name;
    ASSERT_GT(dot(ma.hit.shading.s, mb.hit.shading.s), .999f - bend) << name;
    ASSERT_LT((ma.hit.uv - mb.hit.uv).length(), 1e-4f / grazing) << name;
    ASSERT_NEAR(ma.hit.t / wa->geometry.scale, mb.hit.t / wb->geometry.scale, 2 * tolerance * size / grazing)
        << name;
  }
  EXPECT_GT(hits, 2000) << name;
  EXPECT_LT(differ, 20) << name;
}

// complete() must confirm each hit that the BVH finds. The BVH transforms rays to a group's space in float32,
// so for rays that barely touch a small ball the two could disagree. A path that lost such a hit would see
// what is behind everything.
TEST(Instances, HitsOfTheBvhAreReproduced) {
  for (const bool ball : {true, false}) {
    SceneBuilder builder;
    if (ball)
      builder.shape(SphereShape{}, {}, builder.diffuse(.5));
    else
      builder.shape(CylinderShape{}, {}, builder.diffuse(.5));
    builder = instanced(
        builder, {translate({.33, .1, .7}) * test::rotate_x(37) * test::rotate_y(15) * test::scale(.003)});
    builder.shape(CubeShape{}, test::scale(10), builder.diffuse(.5));
    const auto w = test::world_of(builder);
    std::mt19937 rng(3);
    std::uniform_real_distribution<double> uniform(0, 1);
    const V3d from(1, 2, -6), center(.33, .1, .7), along = (center - from).normalized();
    const V3d u = V3d(along.y, -along.x, 0).normalized(), v = along.cross(u);
    std::uint64_t met = 0;
    for (int i = 0; i < 2'000'000; ++i) {
      // Rays towards the rim of the ball, within a thousandth of its radius.
      const double angle = 2 * 3.14159265358979 * uniform(rng), r = .003 * (.9995 + .001 * uniform(rng));
      const V3d to = center + u * (r * std::cos(angle)) + v * (r * std::sin(angle));
      const V3 o((from - w->geometry.center) * w->geometry.scale), d((to - from).normalized());
      const auto primitive = w->accel.nearest(o, d, kInfinity);
      ASSERT_TRUE(primitive);
      SurfaceHit hit;
      ASSERT_TRUE(w->geometry.complete(*primitive, o, d, hit)) << i << (ball ? " ball" : " tube");
      met += primitive->instance != kNone;
    }
    EXPECT_GT(met, 1000u);
  }
}

const Transform kSimilar = translate({3, -1, 2}) * test::rotate_x(40) * test::rotate_y(25) * test::scale(.3);
const Transform kStretched =
    translate({-2, 1, 1}) * test::rotate_y(70) * test::scale(2, .5, .8) * test::rotate_x(20);
const Transform kMirrored = translate({0, 3, 0}) * test::rotate_x(10) * test::scale(-1.2, .9, 1);

TEST(Instances, MeshesLookAsIfPlacedDirectly) {
  SceneBuilder builder;
  builder.shape(sheet(builder), test::rotate_x(15), brushed(builder));
  expect_alike(instanced(builder, {kSimilar}), copied(builder, {kSimilar}), "similar");
  expect_alike(instanced(builder, {kStretched}), copied(builder, {kStretched}), "stretched", .01f);
  expect_alike(instanced(builder, {kMirrored}), copied(builder, {kMirrored}), "mirrored", .01f);
  expect_alike(instanced(builder, {kSimilar, kStretched, kMirrored}),
               copied(builder, {kSimilar, kStretched, kMirrored}), "all", .01f);
}

TEST(Instances, AnalyticShapesLookAsIfPlacedDirectly) {
  for (const ls::Geometry& g :
       {ls::Geometry{SphereShape{}}, ls::Geometry{CylinderShape{}}, ls::Geometry{DiskShape{}},
        ls::Geometry{CubeShape{}}, ls::Geometry{RectangleShape{}}}) {
    SceneBuilder builder;
    builder.shape(g, translate({.2, .1, -.3}) * test::scale(.8), brushed(builder));
    expect_alike(instanced(builder, {kSimilar}), copied(builder, {kSimilar}), "analytic");
  }
}

// An ellipsoid, x^2/4 + y^2 + z^2/9 = 1, which is possible only as an instance of a sphere.
TEST(Instances, MayStretchSpheres) {
  SceneBuilder builder;
  builder.shape(SphereShape{}, {}, builder.diffuse(.5));
  const auto w = test::world_of(instanced(builder, {test::scale(2, 1, 3)}));
  std::mt19937 rng(6);
  std::normal_distribution<double> normal;
  for (int i = 0; i < 2000; ++i) {
    const double x = normal(rng), y = normal(rng), z = normal(rng);
    const V3d from = V3d(x, y, z).normalized() * 8, d = -from.normalized();
    const Met m = meet(*w, from, d);
    ASSERT_TRUE(m.any);
    ASSERT_NEAR(m.p.x * m.p.x / 4 + m.p.y * m.p.y + m.p.z * m.p.z / 9, 1, 2e-6);
    const V3d gradient(m.p.x / 4, m.p.y, m.p.z / 9);
    ASSERT_GT(V3d(m.hit.ng).dot(gradient.normalized()), 1 - 1e-6);
  }
}

// Values of Mitsuba 3.9.1 for a ray at instances of unit shapes: normal, uv, direction of dp/du.
struct SeenInstance {
  ls::Geometry shape;
  Transform to_world;
  V3 normal;
  V2 uv;
  V3 dp_du;
};
TEST(Instances, HaveMitsubasNormalsUvAndTangents) {
  const Transform mirror = test::scale(-1, 1, 1), depths = test::scale(2, 1, 3),
                  both = test::rotate_x(30) * test::scale(-1, .5, 2);
  const SeenInstance all[] = {
      {SphereShape{},
       mirror,
       {.986941f, .0197388f, .159869f},
       {.496817f, .448893f},
       {.124023f, -6.20113f, 0}},
      {CubeShape{}, mirror, {1, 0, 0}, {.51f, .58f}, {0, 2, 0}},
      {CylinderShape{}, mirror, {.9998f, .019996f, 0}, {.496817f, .159998f}, {.125639f, -6.28193f, 0}},
      {SphereShape{},
       depths,
       {.996106f, .0796885f, .0377107f},
       {.0063628f, .481958f},
       {-.501447f, 6.26808f, 0}},
      {CubeShape{}, depths, {1, 0, 0}, {.52f, .471667f}, {0, 2, 0}},
      {CylinderShape{}, depths, {.996815f, .0797452f, 0}, {.0063628f, .0566613f}, {-.502253f, 6.27816f, 0}},
      {SphereShape{},
       both,
       {.929406f, .30326f, .21033f},
       {.46891f, .47952f},
       {1.21706f, -2.66343f, -1.53773f}},
      {CubeShape{}, both, {1, 0, 0}, {.59732f, .532141f}, {0, .866025f, .5f}},
      {CylinderShape{},
       both,
       {.930046f, .318214f, .183721f},
       {.46896f, .0642947f},
       {1.21765f, -2.66912f, -1.54102f}},
  };
  for (const SeenInstance& s : all) {
    SceneBuilder builder;
    builder.shape(s.shape, {}, brushed(builder));
    const auto w = test::world_of(instanced(builder, {s.to_world}));
    const Met m = meet(*w, {5, .1, .2}, V3d(-5, -.1, -.05).normalized());
    ASSERT_TRUE(m.any);
    EXPECT_LT((m.hit.shading.n - s.normal).length(), 2e-5f) << m.hit.shading.n << s.normal;
    EXPECT_LT((m.hit.uv - s.uv).length(), 2e-5f) << m.hit.uv << s.uv;
    EXPECT_LT((m.hit.shading.s - s.dp_du.normalized()).length(), 2e-5f) << m.hit.shading.s << s.dp_du;
  }
}

// As in Mitsuba, normals of a mirrored instance keep pointing outwards.
TEST(Instances, KeepOutsideOutsideWhenMirrored) {
  for (const ls::Geometry& g :
       {ls::Geometry{SphereShape{}}, ls::Geometry{CubeShape{}}, ls::Geometry{CylinderShape{}}}) {
    for (const bool flip : {false, true}) {
      SceneBuilder builder;
      builder.shape(g, {}, builder.diffuse(.5)).flip_normals = flip;
      const auto w = test::world_of(instanced(builder, {test::scale(-1, 1, 1)}));
      const Met m = meet(*w, {5, .1, .5}, {-1, 0, 0});
      ASSERT_TRUE(m.any);
      EXPECT_EQ(m.hit.ng.x > 0, !flip);
    }
  }
}

// Objects of several shapes and materials.
SceneBuilder furniture() {
  SceneBuilder builder({12, 8});
  builder.shape(sheet(builder), translate({0, 0, .4}) * test::scale(.3), builder.diffuse(.7));
  builder.shape(SphereShape{}, translate({.5, .4, -.1}) * test::scale(.25), builder.glass(1.5));
  builder.shape(CylinderShape{}, translate({-.5, .4, -.3}) * test::scale(.2), builder.mirror());
  return builder;
}
SceneBuilder with_room(SceneBuilder builder) {
  const BsdfIndex white = builder.diffuse(.6);
  builder.shape(RectangleShape{}, translate({0, 0, -1}) * test::scale(3), white);
  const TextureIndex light = builder.texture({3, 2, 1});
  builder.shape(RectangleShape{}, translate({0, 0, 2}) * test::rotate_x(180) * test::scale(.8), white)
      .emitter = AreaEmitter{light};
  builder.environment(.1);
  builder.look({0, -5, 1}, {0, 0, 0}, 40);
  return builder;
}

TEST(Instances, GiveTheLightOfTheirCopies) {
  // Spheres and cylinders can be placed directly only by transforms that scale uniformly.
  const std::vector<Transform> places = {translate({.6, 0, 0}) * test::rotate_x(20) * test::scale(1.1),
                                         translate({-.9, .5, -.2}) * test::rotate_y(35) * test::scale(.6)};
  const auto a = test::estimate(with_room(instanced(furniture(), places)), 256),
             b = test::estimate(with_room(copied(furniture(), places)), 256);
  for (std::size_t c = 0; c < 3; ++c) {
    // With the same random numbers, paths meet the same surfaces up to rounding, so the images are much
    // closer than independent ones.
    EXPECT_NEAR(a.mean[c], b.mean[c], std::max(.5 * b.standard_error[c], 1e-4 * b.mean[c]));
  }
  EXPECT_EQ(a.health.nonfinite + a.health.negative, 0u);
}

TEST(Instances, MediaInsideUseWorldLengths) {
  SceneBuilder builder;
  const MediumIndex fog = builder.homogeneous({.25, .5, 1}, {0, 0, 0});
  builder.container(CubeShape{}, test::scale(.5), builder.null(), fog);
  builder = instanced(std::move(builder), {translate({4, 0, 0}) * test::scale(3, 2, 1)});
  builder.environment();
  builder.look({4, -9, 0}, {4, 0, 0});  // through 2 units of the medium
  const auto e = test::estimate(builder, 64);
  for (std::size_t c = 0; c < 3; ++c)
    EXPECT_NEAR(e.mean[c], std::exp(-2 * std::get<HomogeneousMedium>(builder.scene.media[0]).sigma_t[c]),
                5 * e.standard_error[c] + 1e-5);
}

TEST(Instances, InstancedMasksPassTheirShareOfLight) {
  SceneBuilder builder;
  const BsdfIndex grey = builder.diffuse(.5);
  builder.shape(
      RectangleShape{}, {},
      builder.bsdf(MaskBsdf{builder.texture({.25, .25, .25}), builder.bsdf(TwoSidedBsdf{grey, grey})}));
  builder.shape(RectangleShape{}, translate({9, 0, 0}) * test::scale(.1),
                grey);  // something opaque next to it
  builder = instanced(std::move(builder), {translate({0, 0, 1}), translate({0, 0, 1.5})});
  // A floor under two masks, lit from straight above, has the irradiance (1 - .25)^2.
  builder.shape(RectangleShape{}, test::scale(.5), builder.diffuse(1));
  builder.scene.emitters.push_back(DirectionalEmitter{{0, 0, -1}, {test::kPi, test::kPi, test::kPi}});
  builder.scene.integrator.max_depth = 2;
  builder.look({0, 0, .5}, {0, 0, 0}, 1e-3, {0, 1, 0});
  const auto e = test::estimate(builder, 64);
  EXPECT_NEAR(e.mean[0], .5625, 5 * e.standard_error[0] + 1e-5);
}

TEST(Instances, BlockShadowRays) {
  SceneBuilder builder;
  builder.shape(RectangleShape{}, {}, builder.diffuse(.5));
  builder = instanced(std::move(builder), {translate({0, 0, 1})});
  const auto w = test::world_of(builder);
  const auto at = [&](const V3d& p) { return V3((p - w->geometry.center) * w->geometry.scale); };
  EXPECT_TRUE(w->accel.occluded(at({.3, .2, 0}), {0, 0, 1}, kInfinity));
  EXPECT_FALSE(w->accel.occluded(at({1.3, .2, 0}), {0, 0, 1}, kInfinity));
  EXPECT_FALSE(w->accel.occluded(at({.3, .2, 2}), {0, 0, 1}, kInfinity));
}

TEST(Instances, KeepAGroupInMemoryOnce) {
  SceneBuilder builder;
  builder.shape(sheet(builder), {}, builder.diffuse(.5));
  std::vector<Transform> places;
  for (int i = 0; i < 20000; ++i)
    places.push_back(translate({1. * (i % 100), 1. * (i / 100), 0}) * test::scale(.4));
  const auto many = test::world_of(instanced(builder, places)),
             one = test::world_of(instanced(builder, {{}}));
  EXPECT_EQ(many->geometry.triangle_count(), one->geometry.triangle_count());
  // Allows a kilobyte of memory per instance, in the BVH and elsewhere.
  EXPECT_LT(many->accel.bytes() + many->geometry.bytes(),
            one->accel.bytes() + one->geometry.bytes() + 20000 * 1024u);
  EXPECT_TRUE(meet(*many, {50, 50, 5}, {0, 0, -1}).any);
  EXPECT_EQ(meet(*many, {50, 50, 5}, {0, 0, -1}).hit.primitive.instance, 50u * 100 + 50);
}

TEST(Instances, ScaleByAPowerOfTwoChangesNoBit) {
  const auto render = [](const SceneBuilder& builder) {
    return render_tile(*test::world_of(builder), {0, 0, 12, 8}, {0, 8}, nullptr, nullptr).sums;
  };
  const auto places = std::vector<Transform>{kSimilar, kStretched};
  const auto reference = render(with_room(instanced(furniture(), places)));
  SceneBuilder large = instanced(furniture(), places);
  for (Shape& s : large.scene.shapes) s.to_world = test::scale(64) * s.to_world;
  for (Instance& i : large.scene.instances) i.to_world = i.to_world * test::scale(1 / 64.);
  EXPECT_EQ(render(with_room(large)), reference) << "of the group";
}

std::string error_of(const SceneBuilder& builder) {
  const auto w = build_world(builder.scene, test::settings_of(builder.scene), builder.files, 1);
  return w ? "" : w.error().message;
}

TEST(Instances, SingularTransformIsRefused) {
  const SceneBuilder builder = furniture();
  EXPECT_THAT(error_of(instanced(builder, {{}, test::scale(1, 0, 1)})),
              HasSubstr("instance 2: its to_world has no inverse"));
  EXPECT_THAT(error_of(instanced(builder, {{}, test::scale(1e-30)})),
              HasSubstr("instance 2: its to_world makes the group too small"));
  // Such instances are so small or flat that rays in the group's space would begin farther away than Embree
  // accepts; it would abort the process.
  EXPECT_THAT(error_of(instanced(builder, {{}, test::scale(1e20, 1, 1)})),
              HasSubstr("instance 1: its to_world makes the group too small or too flat"));
  EXPECT_THAT(error_of(instanced(builder, {test::scale(1e300)})), HasSubstr("instance 1"));
  SceneBuilder wrong = instanced(builder, {{}});
  wrong.scene.instances[0].group = {7};
  EXPECT_THAT(error_of(wrong), HasSubstr("a group that the scene does not have"));
  wrong = instanced(builder, {{}});
  wrong.scene.shapes[0].emitter = AreaEmitter{wrong.texture({1, 1, 1})};
  EXPECT_THAT(error_of(wrong), HasSubstr("emits light in a group"));
}

TEST(Instances, AreVisibleInAWorldOfInstancesOnly) {
  SceneBuilder builder;
  builder.shape(SphereShape{}, {}, builder.diffuse(.5));
  const auto w = test::world_of(instanced(builder, {translate({7, 0, 0})}));
  EXPECT_TRUE(meet(*w, {7, 0, 5}, {0, 0, -1}).any);
  EXPECT_FALSE(meet(*w, {0, 0, 5}, {0, 0, -1}).any);
}

}  // namespace
}  // namespace ls::render
