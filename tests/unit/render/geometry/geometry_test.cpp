// Intersections at extreme scales, orientation, tangents and closed boxes; rays that begin far outside of the
// scene, and cameras whose rays are not finite.
#include "worker/render/geometry/geometry.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "tests/support/render_check.h"
#include "tests/unit/render/hits.h"

namespace ls::render {
namespace {

using test::SceneBuilder;
using test::translate;
using test::operator*;

constexpr double kFarOut = std::numeric_limits<double>::infinity();

Sphere sphere(const V3d& c, double r) {
  Sphere s;
  s.center = c;
  s.radius = r;
  return s;
}

TEST(SphereIntersection, IsExactForDistantTinyAndGrazingRays) {
  EXPECT_NEAR(intersect(sphere({0, 0, 1e6}, 1), {0, 0, 0}, {0, 0, 1}, 0, kFarOut), 1e6 - 1, 1e-9);
  EXPECT_NEAR(intersect(sphere({0, 0, 1}, 1e-6), {0, 0, 0}, {0, 0, 1}, 0, kFarOut), 1 - 1e-6, 1e-15);
  EXPECT_NEAR(intersect(sphere({0, 0, 0}, 1), {0, 0, 0}, {0, 0, 1}, 0, kFarOut), 1, 0);
  // At a distance of 1 - 1e-12 from the centre half the chord is sqrt(2e-12).
  EXPECT_NEAR(intersect(sphere({0, 0, 0}, 1), {-5, 1 - 1e-12, 0}, {1, 0, 0}, 0, kFarOut),
              5 - std::sqrt(2e-12), 1e-9);
  EXPECT_EQ(intersect(sphere({0, 0, 0}, 1), {-5, 1 + 1e-12, 0}, {1, 0, 0}, 0, kFarOut), kFarOut);
  EXPECT_EQ(intersect(sphere({0, 0, 0}, 1), {0, 0, 5}, {0, 0, 1}, 0, kFarOut), kFarOut) << "behind";
  EXPECT_EQ(intersect(sphere({0, 0, 0}, 1), {0, 0, -5}, {0, 0, 1}, 0, 4), kFarOut) << "beyond t_max";
}

// A box of size 2, and a lamp of radius 1e5 at 1e7. If the world were centred on both, 2 would be two ulps of
// float32 coordinates.
TEST(World, IsCentredAtAMeshThatWouldOtherwiseLoseItsShape) {
  SceneBuilder builder;
  builder.shape(CubeShape{}, {}, builder.diffuse(.5));
  builder.shape(SphereShape{}, translate({0, 1e7, 0}) * test::scale(1e5), builder.diffuse(0));
  const auto g = Geometry::build(builder.scene, AssetLoader{builder.scene, builder.files});
  ASSERT_TRUE(g.has_value());
  EXPECT_EQ(g->center.x, 0);
  EXPECT_EQ(g->center.y, 0);
  for (const V3& p : g->positions)
    for (int k = 0; k < 3; ++k) EXPECT_EQ(std::abs(p[k]) / g->scale, 1);
  const double far = g->spheres.at(0).center.length() + g->spheres.at(0).radius;
  EXPECT_LE(far, 1) << "the world is no longer of unit size";
  EXPECT_GE(far, .5);
  EXPECT_GE(g->radius, far);
}

TEST(World, IsCentredAtItsMiddleIfAllMeshesAreWellResolved) {
  SceneBuilder builder;
  builder.shape(CubeShape{}, {}, builder.diffuse(.5));
  builder.shape(CubeShape{}, translate({100, 0, 0}), builder.diffuse(.5));
  const auto g = Geometry::build(builder.scene, AssetLoader{builder.scene, builder.files});
  ASSERT_TRUE(g.has_value());
  EXPECT_EQ(g->center.x, 50);
}

// The BVH, which computes in float32, may report a surface that lies just behind the ray's origin.
TEST(Hits, HaveNoNegativeDistance) {
  SceneBuilder builder;
  builder.shape(RectangleShape{}, {}, builder.diffuse(.5));
  builder.shape(DiskShape{}, {}, builder.diffuse(.5));
  const auto g = Geometry::build(builder.scene, AssetLoader{builder.scene, builder.files});
  ASSERT_TRUE(g.has_value());
  for (const auto kind : {PrimitiveId::Kind::triangle, PrimitiveId::Kind::disk}) {
    const PrimitiveId id{kind, 0};
    SurfaceHit hit;
    for (const float behind : {0.f, 1e-7f, 1e-3f}) {
      ASSERT_TRUE(g->complete(id, {.1f, -.2f, behind}, {0, 0, 1}, hit));
      EXPECT_EQ(hit.t, 0) << behind;
    }
    ASSERT_TRUE(g->complete(id, {.1f, -.2f, -.25f}, {0, 0, 1}, hit));
    EXPECT_EQ(hit.t, .25f);
  }
}

TEST(DiskIntersection, EndsAtItsRimAndIgnoresParallelRays) {
  Disk d;
  d.center = {0, 0, 1e-5};
  d.u = {1e-6, 0, 0};
  d.v = {0, 2e-6, 0};
  d.n = {0, 0, 1};
  EXPECT_NEAR(intersect(d, {.9e-6, 0, 0}, {0, 0, 1}, 0, kFarOut), 1e-5, 1e-20);
  EXPECT_EQ(intersect(d, {1.1e-6, 0, 0}, {0, 0, 1}, 0, kFarOut), kFarOut);
  EXPECT_NEAR(intersect(d, {0, 1.9e-6, 0}, {0, 0, 1}, 0, kFarOut), 1e-5, 1e-20);
  EXPECT_EQ(intersect(d, {0, 0, 0}, {1, 0, 0}, 0, kFarOut), kFarOut);
}

V3 any_direction(std::mt19937& rng) {
  std::normal_distribution<double> n;
  const double x = n(rng), y = n(rng), z = n(rng);
  return V3(V3d(x, y, z).normalized());
}

// Counts how often a path that bounces inside a closed shape gets out.
std::uint64_t leaks(const ls::Geometry& shape, const Transform& t, int rays, unsigned seed) {
  SceneBuilder builder;
  builder.shape(shape, t, builder.diffuse(.5));
  const auto world = test::world_of(builder);
  std::mt19937 rng(seed);
  std::uint64_t lost = 0;
  V3 o(0);
  V3 d = any_direction(rng);
  for (int i = 0; i < rays; ++i) {
    const auto primitive = world->accel.nearest(o, d, kInfinity);
    SurfaceHit hit;
    if (!primitive || !world->geometry.complete(*primitive, o, d, hit)) {
      ++lost;
      o = V3(0);
      continue;
    }
    d = any_direction(rng);
    // The centre of these shapes is the origin: d is turned inwards.
    if (dot(d, hit.ng) * dot(hit.ng, hit.p) > 0) d = -d;
    o = offset_point(hit, d);
  }
  return lost;
}

TEST(ClosedShapes, LoseNoRayAtAnyScale) {
  for (const double s : {1e-4, .37, 1., 12345.6, 1e6}) {
    const Transform t = test::rotate_x(33) * test::rotate_y(21) * test::scale(s);
    EXPECT_EQ(leaks(CubeShape{}, t, 100000, 1), 0u) << s;
    EXPECT_EQ(leaks(SphereShape{}, t, 100000, 2), 0u) << s;
  }
  EXPECT_EQ(leaks(CubeShape{}, test::scale(1, .01, 300), 100000, 3), 0u);
  EXPECT_EQ(leaks(CubeShape{}, {}, 400000, 4), 0u);
}

std::shared_ptr<const World> one(const ls::Geometry& g, const Transform& t, bool flip) {
  SceneBuilder builder;
  builder.shape(g, t, builder.diffuse(.5)).flip_normals = flip;
  return test::world_of(builder);
}

// Values of Mitsuba 3.9.1 for rays at unit shapes (scalar_rgb, ray_intersect): shading normal, uv, and the
// direction of dp/du.
struct SeenShape {
  const char* shape;
  V3d from, to;
  V3 normal;
  V2 uv;
  V3 along_u;
};
const SeenShape kSeenShapes[] = {
    {"cube", {5, .6, .8}, {0, 0, 0}, {1, 0, 0}, {.56f, .42f}, {0, 1, 0}},
    {"cube", {-5, .6, .8}, {0, 0, 0}, {-1, 0, 0}, {.56f, .58f}, {0, 1, 0}},
    {"cube", {.6, 5, .8}, {0, 0, 0}, {0, 1, 0}, {.44f, .42f}, {-1, 0, 0}},
    {"cube", {.6, -5, .8}, {0, 0, 0}, {0, -1, 0}, {.58f, .56f}, {0, 0, 1}},
    {"cube", {.6, .8, 5}, {0, 0, 0}, {0, 0, 1}, {.58f, .56f}, {0, 1, 0}},
    {"cube", {.6, .8, -5}, {0, 0, 0}, {0, 0, -1}, {.42f, .56f}, {0, -1, 0}},
    {"rectangle", {.6, .4, 5}, {.3, .2, 0}, {0, 0, 1}, {.65f, .6f}, {1, 0, 0}},
    {"sphere",
     {5, .6, .8},
     {0, 0, 0},
     {.980581f, .11767f, .156893f},
     {.0190077f, .449852f},
     {-.11915f, .99288f, 0}},
    {"sphere",
     {-5, .6, .8},
     {0, 0, 0},
     {-.980581f, .11767f, .156893f},
     {.480992f, .449852f},
     {-.11915f, -.99288f, 0}},
    {"sphere",
     {.6, -5, .8},
     {0, 0, 0},
     {.11767f, -.980581f, .156893f},
     {.769008f, .449852f},
     {.99288f, .11915f, 0}},
    {"sphere", {.6, .8, -5}, {0, 0, 0}, {.11767f, .156893f, -.980581f}, {.147584f, .937167f}, {-.8f, .6f, 0}},
    {"disk", {.6, .4, 5}, {.3, .2, 0}, {0, 0, 1}, {.360555f, .0935835f}, {.83205f, .5547f, 0}},
};
// Mitsuba's values are printed with 6 digits (dp/du with 5).
void expect_near(const V3& a, const V3& b, const char* what) {
  EXPECT_LT((a - b).length(), 2e-5f) << what << a << b;
}
ls::Geometry named(const std::string& name) {
  if (name == "cube") return CubeShape{};
  if (name == "rectangle") return RectangleShape{};
  if (name == "disk") return DiskShape{};
  return SphereShape{};
}

TEST(Shapes, NormalsUvAndTangentsAreMitsubas) {
  for (const SeenShape& s : kSeenShapes) {
    SceneBuilder builder;
    builder.shape(named(s.shape), {}, brushed(builder));
    const SurfaceHit h = hit_towards(*test::world_of(builder), s.from, s.to);
    expect_near(h.shading.n, s.normal, s.shape);
    expect_near({h.uv.x, h.uv.y, 0}, {s.uv.x, s.uv.y, 0}, s.shape);
    expect_near(h.shading.s, s.along_u, s.shape);
  }
}

// The side that shines in Mitsuba 3.9.1: flat shapes and cubes keep the transformed normal, a mirrored sphere
// is inside out, and flip_normals reverses the normals of each.
TEST(Shapes, EmitToMitsubasSide) {
  for (const char* name : {"cube", "rectangle", "disk", "sphere"}) {
    for (const bool mirror : {false, true}) {
      for (const bool flip : {false, true}) {
        const bool inside_out = flip != (mirror && std::string(name) == "sphere");
        const auto world = one(named(name), test::scale(mirror ? -1 : 1, 1, 1), flip);
        const SurfaceHit h = hit_towards(*world, {.3, .2, 5}, {.3, .2, 0});
        EXPECT_EQ(h.ng.z > 0, !inside_out) << name << mirror << flip;
        EXPECT_EQ(h.shading.n.z > 0, !inside_out) << name << mirror << flip;
      }
    }
  }
}

// The hit on a square in z = 0 that is read from an OBJ file, with or without vertex normals along +z or -z.
SurfaceHit square_hit(bool normals, bool mirror, int z = 1) {
  std::string text = "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nvn 0 0 " + std::to_string(z) + "\n";
  text += normals ? "f 1//1 2//1 3//1\nf 1//1 3//1 4//1\n" : "f 1 2 3\nf 1 3 4\n";
  SceneBuilder builder;
  MeshShape mesh;
  mesh.file = builder.asset("square.obj", text);
  mesh.face_normals = !normals;
  builder.shape(mesh, test::scale(mirror ? -1 : 1, 1, 1), builder.diffuse(.5));
  return hit_towards(*test::world_of(builder), {.3, .2, 5}, {.3, .2, 0});
}

TEST(Meshes, FollowTheirNormalsAndElseTheirWinding) {
  EXPECT_EQ(square_hit(true, false).shading.n.z, 1.f);
  EXPECT_EQ(square_hit(true, true).shading.n.z, 1.f);
  EXPECT_EQ(square_hit(true, true).ng.z, 1.f);
  EXPECT_EQ(square_hit(false, false).ng.z, 1.f);
  EXPECT_EQ(square_hit(false, true).ng.z, -1.f);
}

TEST(Meshes, FollowTheirNormalsEvenAgainstTheirWinding) {
  for (const bool mirror : {false, true}) {
    EXPECT_EQ(square_hit(true, mirror, -1).shading.n.z, -1.f);
    EXPECT_EQ(square_hit(true, mirror, -1).ng.z, -1.f);
  }
}

// A closed room that emits light. Its vertex normals point inwards, against its winding, and its medium is on
// the side that is inside by the winding.
TEST(Meshes, EmitTowardsTheirNormalsAndKeepTheirMediaInside) {
  std::string text =
      "v -1 -1 -1\nv 1 -1 1\nv -1 1 1\nv 1 1 -1\nvn 1 1 1\nvn -1 1 -1\nvn 1 -1 -1\nvn -1 -1 1\n";
  text += "f 1//1 4//4 2//2\nf 1//1 3//3 4//4\nf 1//1 2//2 3//3\nf 2//2 4//4 3//3\n";
  for (const bool filled : {false, true}) {
    SceneBuilder builder;
    MeshShape mesh;
    mesh.file = builder.asset("room.obj", text);
    const MediumIndex dark = builder.homogeneous({3, 3, 3}, {0, 0, 0});
    Shape& room = builder.lamp(mesh, {});
    if (filled) {
      room.interior = dark;
      room.is_medium_transition = true;
      builder.scene.sensor.medium = dark;
    }
    builder.look({0, 0, 0}, {.3, .3, .3});
    const auto e = test::estimate(builder, 1);
    if (filled) {
      EXPECT_GT(e.mean[0], 0);
      EXPECT_LT(e.mean[0], std::exp(-3 * .5));  // the nearest wall is farther than .5
    } else {
      EXPECT_EQ(e.mean[0], 1);
    }
  }
}

TEST(Meshes, WithoutNormalsAreSmooth) {
  // A roof without normals, hit near its ridge. The shading normal of Mitsuba 3.9.1 is (.0358577, 0,
  // .999357).
  const std::string text =
      "v -1 -1 0\nv 0 -1 1\nv 0 1 1\nv -1 1 0\nv 1 -1 0\nv 1 1 0\nf 1 2 3\nf 1 3 4\nf 2 5 6\nf 2 6 3\n";
  SceneBuilder builder;
  MeshShape mesh;
  mesh.file = builder.asset("roof.obj", text);
  builder.shape(mesh, {}, builder.diffuse(.5));

  const SurfaceHit h = hit_towards(*test::world_of(builder), {.05, .2, 5}, {.05, .2, 0});

  expect_near(h.shading.n, {.0358577f, 0, .999357f}, "smooth");
  expect_near(h.ng, {.707107f, 0, .707107f}, "flat");
}

TEST(Normals, ShadingFrameIsRightHandedAndAgreesWithTheGeometricNormal) {
  for (const ls::Geometry& g : {ls::Geometry{CubeShape{}}, ls::Geometry{SphereShape{}},
                                ls::Geometry{DiskShape{}}, ls::Geometry{RectangleShape{}}}) {
    const SurfaceHit h = hit_towards(*one(g, {}, false), {.3, .4, 5}, {.2, .3, 0});
    EXPECT_NEAR(dot(h.shading.n, h.ng), 1, 1e-6);
    EXPECT_NEAR(dot(cross(h.shading.s, h.shading.t), h.shading.n), 1, 1e-6);
  }
}

TEST(Offset, MovesToTheSideOfTheDirection) {
  for (const float z : {-1.f, 1.f}) {
    const V3 p = offset_point(V3(.5f, .25f, .125f), V3(0, 0, 1), 1, V3(.1f, 0, z));
    EXPECT_EQ(p.z > .125f, z > 0);
    EXPECT_NEAR(std::abs(p.z - .125f), 0x1p-20f, 0x1p-26f);
  }
}

constexpr float kInf = std::numeric_limits<float>::infinity();

// Debian's build of Embree aborts for rays whose origin is farther than 1.8e18. A flight through an extremely
// thin medium can get there.
TEST(FarAway, DistantRaysMissEverythingAndLightIsUnblocked) {
  SceneBuilder builder;
  builder.shape(SphereShape{}, {}, builder.diffuse(.5));
  const auto w = test::world_of(builder);
  for (const float far : {1e10f, 1e18f, 1e20f, 3e38f}) {
    EXPECT_FALSE(w->accel.nearest({0, 0, far}, {0, 0, -1}, kInf)) << far;
    EXPECT_FALSE(w->accel.nearest({-far, 0, 0}, {0, 1, 0}, kInf)) << far;
    EXPECT_FALSE(w->accel.occluded({0, far, 0}, {0, -1, 0}, kInf)) << far;
  }
  EXPECT_TRUE(w->accel.nearest({0, 0, 1e3f}, {0, 0, -1}, kInf));
  EXPECT_TRUE(w->accel.occluded({0, 0, 1e3f}, {0, 0, -1}, kInf));
  EXPECT_TRUE(w->accel.occluded({0, 0, std::nanf("")}, {0, 0, -1}, kInf));
}

TEST(FarAway, ExtremelyThinMediumRendersWithoutBadSamples) {
  SceneBuilder builder({8, 8});
  builder.shape(SphereShape{}, {}, builder.diffuse(.5));
  builder.scene.emitters.push_back(PointEmitter{{0, 0, 3}, {1, 1, 1}});
  builder.scene.sensor.medium = builder.homogeneous({1e-20, .3, 1.7}, {.9, .9, .9});
  builder.look({0, -5, 0}, {0, 0, 0}, 60);
  const auto e = test::estimate(builder, 64);
  EXPECT_EQ(e.health.nonfinite, 0u);
  EXPECT_GT(e.mean[0], 0);
}

std::string refusal(const Sensor& sensor) {
  SceneBuilder builder;
  builder.shape(SphereShape{}, {}, builder.diffuse(.5));
  builder.scene.sensor = sensor;
  const auto w = build_world(builder.scene, test::settings_of(builder.scene), builder.files, 1);
  return w ? "" : w.error().message;
}

TEST(FarAway, CamerasWithNonFiniteRaysAreRefused) {
  constexpr double kHuge = 1.7e308;
  const auto refused = testing::HasSubstr("the rays of the sensor leave the range of single precision");
  EXPECT_THAT(refusal({.principal_point_offset = {-kHuge, 0}}), refused);
  EXPECT_THAT(refusal({.principal_point_offset = {0, kHuge}}), refused);
  EXPECT_THAT(refusal({.near_clip = 1e300, .far_clip = kHuge}), refused);
  EXPECT_THAT(refusal({.aperture_radius = kHuge}), refused);
  EXPECT_THAT(refusal({.aperture_radius = 1e-30, .focus_distance = 1e-300}), refused);
  EXPECT_EQ(refusal({.fov = 179.9, .far_clip = kHuge, .aperture_radius = 3, .focus_distance = 1e-3}), "");
}

}  // namespace
}  // namespace ls::render
