// Regions without surfaces: which bodies have one, which points it contains, where rays leave it for good;
// and that the image is the same, up to rounding, as if every ray were traced.
#include <gtest/gtest.h>

#include <limits>

#include "tests/support/render_check.h"
#include "worker/render/geometry/clear_region.h"
#include "worker/render/world/world.h"
#include "worker/render/world/world_build.h"

namespace ls::render {
namespace {

using test::operator*;
using test::SceneBuilder;
using test::translate;

// A body filled with a grey medium, above a floor, under a sun and a sky.
SceneBuilder body(const ls::Geometry& g, const Transform& to_world, bool grid = false) {
  SceneBuilder b({12, 8});
  std::vector<float> values;
  for (int i = 0; i < 8 * 8 * 8; ++i) values.push_back(static_cast<float>(i * 7919 % 11) / 5);
  const MediumIndex m =
      grid ? b.heterogeneous(b.grid({8, 8, 8}, values, to_world * translate({-1, -1, -1}) * test::scale(2)),
                             {.99, .9, .8}, 4, .5)
           : b.homogeneous({4, 4, 4}, {.99, .9, .8}, .5);
  b.container(g, to_world, b.null(), m);
  b.shape(RectangleShape{}, translate({0, 0, -3}) * test::scale(9), b.diffuse(.5));
  b.scene.emitters.push_back(DirectionalEmitter{{.3, .2, -1}, {1, 2, 3}});
  b.environment(.5);
  b.look({0, -6, 1}, {0, 0, 0}, 30);
  return b;
}
const ClearRegion* region_of(const World& w) { return w.media.at(0).clear; }
std::shared_ptr<World> made(const SceneBuilder& b) {
  return make_world(b.scene, test::settings_of(b.scene), b.files, 1).value();
}
// Returns the world's coordinates of a point that is given in scene coordinates.
V3 in_world(const World& w, const Vec3& p) {
  return V3((V3d(p[0], p[1], p[2]) - w.geometry.center) * w.geometry.scale);
}

TEST(ClearRegion, IsTheInsideOfASphereAndOfATurnedBox) {
  const Transform turned = test::rotate_x(20) * test::rotate_y(35) * test::scale(1, .5, .7);
  const auto corner = [&](double x, double y, double z) {
    const auto& m = turned.m;
    return Vec3{m[0] * x + m[1] * y + m[2] * z, m[4] * x + m[5] * y + m[6] * z,
                m[8] * x + m[9] * y + m[10] * z};
  };
  struct Case {
    SceneBuilder scene;
    std::vector<Vec3> in, out;
  };
  const Case cases[] = {
      {body(SphereShape{{.3, 0, 0}, .5}, {}),
       {{.3, 0, 0}, {.79, 0, 0}, {.3, -.49, 0}},
       {{.81, 0, 0}, {.3, 0, -.51}, {.7, .4, 0}}},
      {body(CubeShape{}, {}), {{0, 0, 0}, {.99, .99, -.99}}, {{1.01, 0, 0}, {0, -1.01, 0}, {0, 0, 1.01}}},
      {body(CubeShape{}, turned),
       {corner(.99, .99, .99), corner(-.99, .99, 0)},
       {corner(1.01, 0, 0), corner(0, -1.01, 0), corner(0, 0, 1.01)}},
  };
  for (const Case& c : cases) {
    const auto w = made(c.scene);
    ASSERT_TRUE(region_of(*w));
    for (const Vec3& p : c.in)
      EXPECT_TRUE(region_of(*w)->contains(in_world(*w, p))) << p[0] << ' ' << p[1] << ' ' << p[2];
    for (const Vec3& p : c.out)
      EXPECT_FALSE(region_of(*w)->contains(in_world(*w, p))) << p[0] << ' ' << p[1] << ' ' << p[2];
    const float bad = std::numeric_limits<float>::quiet_NaN(), far = std::numeric_limits<float>::infinity();
    EXPECT_FALSE(region_of(*w)->contains({bad, 0, 0}));
    EXPECT_FALSE(region_of(*w)->contains({far, 0, 0}));
  }
}

TEST(ClearRegion, IsNotUsedNearOtherSurfaces) {
  const auto changed = [](auto&& change) {
    SceneBuilder b = body(CubeShape{}, {});
    change(b);
    return region_of(*made(b)) != nullptr;
  };
  EXPECT_TRUE(changed([](SceneBuilder&) {}));
  EXPECT_FALSE(changed([](SceneBuilder& b) {
    b.shape(SphereShape{{0, 0, 0}, .1}, {}, b.diffuse(.5));
  })) << "inside";
  EXPECT_FALSE(changed([](SceneBuilder& b) { b.shape(RectangleShape{}, test::scale(5), b.diffuse(.5)); }))
      << "through it";
  EXPECT_FALSE(changed([](SceneBuilder& b) {
    b.shape(RectangleShape{}, translate({0, 0, 1}), b.null());
  })) << "on its face";
  EXPECT_TRUE(changed([](SceneBuilder& b) {
    b.shape(SphereShape{{0, 0, 1.5}, .1}, {}, b.diffuse(.5));
  })) << "beside it";
}

// True if a mesh has a clear region. `corners` and `faces` are OBJ text; faces are polygons.
bool has_region(const std::string& corners, const std::string& faces) {
  SceneBuilder b = body(CubeShape{}, {});
  b.scene.shapes[0].geometry = MeshShape{b.asset("body.obj", corners + faces), MeshFormat::obj};
  return region_of(*made(b)) != nullptr;
}

TEST(ClearRegion, IsUsedInSmallConvexMeshes) {
  const std::string below = "v -1 -1 -1\nv 1 -1 -1\nv 1 1 -1\nv -1 1 -1\n",
                    above = "v -1 -1 1\nv 1 -1 1\nv 1 1 1\nv -1 1 1\n", ends = "f 1 4 3 2\nf 5 6 7 8\n",
                    sides = "f 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";
  EXPECT_TRUE(has_region(below + above, ends + sides)) << "a cube";
  EXPECT_TRUE(has_region("v -1 0 0\nv 1 0 0\nv 0 0 1\nv -1 2 0\nv 1 2 0\nv 0 2 1\n",
                         "f 1 2 3\nf 4 6 5\nf 1 4 5 2\nf 2 5 6 3\nf 3 6 4 1\n"))
      << "a roof";
  EXPECT_FALSE(has_region(below + above, ends)) << "two sides of a layer without an edge";
  EXPECT_FALSE(has_region(below + above, sides)) << "a tube";
  EXPECT_FALSE(has_region(below + above, sides + "f 1 4 3 2\n")) << "a box without a lid";
  EXPECT_FALSE(has_region(below + "v -1 -1 1\nv 1 -1 .999\nv 1 1 1\nv -1 1 .999\n", ends + sides))
      << "a lid with a fold, of seven faces";
  EXPECT_FALSE(
      has_region("v 0 1 0\nv -1 -1 0\nv 0 -.3 0\nv 1 -1 0\nv 0 1 1\nv -1 -1 1\nv 0 -.3 1\nv 1 -1 1\n",
                 "f 1 4 3 2\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n"))
      << "six faces that are not convex";
}

TEST(ClearRegion, IsNotUsedIfAFlightNeedsItsEnd) {
  const auto changed = [](auto&& change) {
    SceneBuilder b = body(SphereShape{}, {});
    change(b);
    return region_of(*made(b)) != nullptr;
  };
  EXPECT_TRUE(changed([](SceneBuilder&) {}));
  EXPECT_FALSE(changed([](SceneBuilder& b) {
    std::get<HomogeneousMedium>(b.scene.media[0]).sigma_t = {1, 2, 3};
  })) << "colours";
  EXPECT_FALSE(changed([](SceneBuilder& b) {
    std::get<HomogeneousMedium>(b.scene.media[0]).emission = {1, 1, 1};
  })) << "glows";
  EXPECT_FALSE(changed([](SceneBuilder& b) {
    b.lamp(SphereShape{}, translate({0, 0, 3}) * test::scale(.1));
  })) << "points are sampled about the lamp";
}

// The distance, in units of the scene, at which a ray from the middle of the body leaves the body for good.
std::optional<float> way_out(const SceneBuilder& b, const V3& d) {
  const auto w = made(b);
  const ClearRegion* const region = region_of(*w);
  if (!region) return std::nullopt;
  auto t = region->way_out(in_world(*w, {0, 0, 0}), d);
  if (t) *t /= static_cast<float>(w->geometry.scale);
  return t;
}

TEST(ClearRegion, KnowsWhereRaysFinallyLeaveTheBody) {
  const V3 up(0, 0, 1), down(0, 0, -1), aslant(.6f, 0, .8f);
  const SceneBuilder cube = body(CubeShape{}, {}), sphere = body(SphereShape{}, {});
  // A few ulps of the coordinates
  constexpr float kRounding = 0x1p-20f;
  EXPECT_NEAR(way_out(cube, up).value(), 1, kRounding);
  EXPECT_NEAR(way_out(cube, aslant).value(), 1.25, kRounding);
  EXPECT_NEAR(way_out(sphere, up).value(), 1, kRounding);
  EXPECT_NEAR(way_out(sphere, aslant).value(), 1, kRounding);
  EXPECT_FALSE(way_out(cube, down)) << "the floor";
  EXPECT_FALSE(way_out(sphere, down)) << "the floor";
  const V3 along(1, 0, -0.f), bad(std::numeric_limits<float>::quiet_NaN(), 0, 1);
  EXPECT_NEAR(way_out(cube, along).value(), 1, kRounding);
  EXPECT_FALSE(way_out(cube, bad));

  SceneBuilder alone = cube;
  alone.scene.shapes.erase(alone.scene.shapes.begin() + 1);
  EXPECT_NEAR(way_out(alone, down).value(), 1, kRounding);
  SceneBuilder roofed = cube;
  roofed.shape(RectangleShape{}, translate({0, 0, 3}), roofed.diffuse(.5));
  EXPECT_FALSE(way_out(roofed, up));
  EXPECT_FALSE(way_out(roofed, aslant)) << "misses the roof, but not the box around roof and floor";
  SceneBuilder glass = cube;
  glass.scene.shapes[0].bsdf = glass.bsdf(DielectricBsdf{});
  EXPECT_FALSE(way_out(glass, up));
  SceneBuilder nested = cube;
  nested.scene.shapes[0].exterior = nested.homogeneous({.1, .1, .1}, {.5, .5, .5}, 0);
  EXPECT_FALSE(way_out(nested, up));
  // Fog fills the space outside, although the body names no medium there.
  SceneBuilder in_fog = cube;
  std::get<HomogeneousMedium>(in_fog.scene.media[0]).priority = 1;
  in_fog.scene.sensor.medium = in_fog.homogeneous({.1, .1, .1}, {.5, .5, .5});
  EXPECT_TRUE(region_of(*made(in_fog)));
  EXPECT_FALSE(way_out(in_fog, up));
}

// Expects pixels that differ by rounding alone. The distance to the surface of a body is rounded differently
// if it is found without a ray: by less than 8 ulps of coordinates below 8, so 2^-18. With an extinction of
// at most 8 that changes transmittances, and so pixels, by a factor of at most 1 +- 2^-15. In grids it could
// also change a tracker's decision near the surface; with these fixed seeds it changes none.
void expect_rounded_alike(const std::vector<float>& a, const std::vector<float>& b, const char* what) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) EXPECT_NEAR(a[i], b[i], 0x1p-15f * b[i]) << what << i;
}

TEST(ClearRegion, ChangesPixelsOnlyByRounding) {
  for (const bool grid : {false, true})
    for (const bool cube : {false, true}) {
      const auto w = made(
          body(cube ? ls::Geometry(CubeShape{}) : ls::Geometry(SphereShape{}), test::rotate_x(20), grid));
      ASSERT_TRUE(region_of(*w) && !w->need.aimed && !w->need.reuse)
          << "the path tracer samples flights first";
      const auto pixels = [&] { return render_tile(*w, {0, 0, 12, 8}, {0, 32}, nullptr, nullptr).sums; };
      const auto with = pixels();
      w->media[0].clear = nullptr;
      expect_rounded_alike(with, pixels(),
                           grid   ? cube ? "grid in a cube " : "grid in a sphere "
                           : cube ? "fog in a cube "
                                  : "fog in a sphere ");
    }
}

TEST(ClearRegion, IsNotUsedBeyondTheCamerasFarClip) {
  SceneBuilder b = body(SphereShape{}, {});
  b.look({0, -.5, 0}, {0, 0, 0}, 30);
  b.scene.sensor.medium = MediumIndex{0};
  b.scene.sensor.far_clip = .05;
  const auto w = made(b);
  const auto pixels = [&] { return render_tile(*w, {0, 0, 12, 8}, {0, 32}, nullptr, nullptr).sums; };
  const auto with = pixels();
  ASSERT_TRUE(region_of(*w));
  w->media[0].clear = nullptr;
  expect_rounded_alike(with, pixels(), "");
}

}  // namespace
}  // namespace ls::render
