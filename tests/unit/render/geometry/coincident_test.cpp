// Surfaces that coincide.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string_view>
#include <utility>
#include <vector>

#include "tests/support/significance.h"
#include "tests/unit/render/integrator/aov_picture.h"
#include "worker/render/geometry/coincident.h"
#include "worker/render/world/world.h"

namespace ls::render {
namespace {

using test::SceneBuilder;
using test::translate;
using test::operator*;

// Counts samples of fog on a floor that are not black. The scene is lit only from below the floor, so all
// light is a leak. `turn` rotates the scene, so that the rounded corners of floor and box have no common
// plane.
std::uint64_t lit_from_below(const Transform& turn, double floor, bool light_is_a_plane) {
  SceneBuilder builder({4, 4});
  const MediumIndex fog = builder.homogeneous({.5, .5, .5}, {.9, .9, .9});
  builder.container(CubeShape{}, turn * translate({0, 0, 1}) * test::scale(2, 2, 1), builder.null(), fog);
  builder.shape(RectangleShape{}, turn * test::scale(floor), builder.diffuse(.5));
  const auto turned = [&](const Vec3& p) {
    const auto& m = turn.m;
    return Vec3{m[0] * p[0] + m[1] * p[1] + m[2] * p[2], m[4] * p[0] + m[5] * p[1] + m[6] * p[2],
                m[8] * p[0] + m[9] * p[1] + m[10] * p[2]};
  };
  if (light_is_a_plane) {
    builder.lamp(RectangleShape{}, turn * translate({0, 0, -50}) * test::scale(40));
  } else {
    builder.scene.emitters.push_back(DirectionalEmitter{turned({0, 0, 1}), {1, 1, 1}});
  }
  builder.look(turned({0, -6, 3}), turned({0, 0, .5}), 40, turned({0, 0, 1}));
  const auto world = test::world_of(builder);
  std::uint64_t leaks = 0;
  for (int y = 0; y < 4; ++y)
    for (int x = 0; x < 4; ++x)
      for (std::uint64_t s = 0; s < 400; ++s) leaks += render_sample(*world, x, y, s).rgb[0] > 0;
  return leaks;
}

TEST(FogOnAFloor, LetsNoLightThroughTheFloor) {
  for (const Transform& turn : {Transform{}, test::rotate_x(17) * test::rotate_y(31)}) {
    EXPECT_EQ(lit_from_below(turn, 4, false), 0u);
    EXPECT_EQ(lit_from_below(turn, 40, false), 0u);
    EXPECT_EQ(lit_from_below(turn, 40, true), 0u);  // no path around the floor's edge reaches the light
  }
}

TEST(Coincident, AreFoundOnlyWhereSurfacesCoincide) {
  const auto found = [](const ls::Geometry& g, const Transform& t) {
    SceneBuilder builder({1, 1});
    const MediumIndex fog = builder.homogeneous({1, 1, 1}, {0, 0, 0});
    builder.container(CubeShape{}, {}, builder.null(), fog);
    builder.shape(g, t, builder.diffuse(.5));
    return test::world_of(builder)->coincident;
  };
  EXPECT_TRUE(found(RectangleShape{}, translate({0, 0, -1}) * test::scale(5)));
  EXPECT_TRUE(found(DiskShape{}, translate({.5, 0, -1}) * test::scale(.1)));
  EXPECT_FALSE(found(RectangleShape{}, translate({0, 0, -1.001}) * test::scale(5)));
  EXPECT_FALSE(found(RectangleShape{}, translate({3, 0, -1})));  // in the plane, but beside it
  EXPECT_FALSE(found(RectangleShape{}, test::scale(5)));         // across it
  EXPECT_FALSE(found(CubeShape{}, test::scale(.5)));
  EXPECT_TRUE(found(CubeShape{}, {}));
  EXPECT_FALSE(found(SphereShape{}, {}));
}

TEST(Coincident, AreFoundAmongRoundShapes) {
  const auto found = [](double radius) {
    SceneBuilder builder({1, 1});
    const MediumIndex fog = builder.homogeneous({1, 1, 1}, {0, 0, 0});
    builder.container(SphereShape{}, {}, builder.null(), fog);
    builder.shape(SphereShape{}, test::scale(radius), builder.glass(1.5));
    return test::world_of(builder)->coincident;
  };
  EXPECT_TRUE(found(1));
  EXPECT_FALSE(found(1.001));
}

// Only the general instantiation of the path tracer (`everything`) handles coincident surfaces. They do not
// imply that media overlap.
TEST(Coincident, NeedTheGeneralVariantWithAndWithoutMedia) {
  for (const bool foggy : {false, true}) {
    SceneBuilder builder({1, 1});
    if (foggy)
      builder.container(CubeShape{}, {}, builder.null(), builder.homogeneous({1, 1, 1}, {0, 0, 0}));
    else
      builder.shape(CubeShape{}, {}, builder.null());
    builder.shape(RectangleShape{}, translate({0, 0, -1}) * test::scale(5), builder.diffuse(.5));
    const auto w = test::world_of(builder);
    EXPECT_TRUE(w->coincident);
    EXPECT_TRUE(w->need.overlaps);
    EXPECT_FALSE(w->overlaps);
    EXPECT_EQ(covering_variants(*w).front(), "everything");
  }
}

// between() lists each surface between two points once, of whatever kind.
TEST(Coincident, AreAllListedByTheAccelerationStructure) {
  SceneBuilder builder({1, 1});
  const BsdfIndex null = builder.null(), grey = builder.diffuse(.5);
  for (int i = 0; i < 3; ++i) builder.shape(RectangleShape{}, test::scale(1 + i), i == 1 ? grey : null);
  builder.shape(DiskShape{}, {}, null);
  builder.shape(SphereShape{}, translate({0, 0, 1}), null);
  const auto w = test::world_of(builder);
  ASSERT_TRUE(w->coincident);
  const auto at = [&](double z) { return V3((V3d(.1, .2, z) - w->geometry.center) * w->geometry.scale); };
  EXPECT_EQ(w->accel.between(at(-.01), at(.001)).count, 4);
  EXPECT_EQ(w->accel.between(at(-.01), at(.1)).count, 5);
  EXPECT_EQ(w->accel.between(at(.1), at(.5)).count, 0);
}

// The spheres are apart from each other, but there are too many to compare all pairs.
TEST(Coincident, AreAssumedWithoutComparingIfThereAreTooManyShapes) {
  constexpr int kSpheres = 12'000;
  SceneBuilder builder({1, 1});
  const BsdfIndex null = builder.null();
  for (int i = 0; i < kSpheres; ++i) builder.shape(SphereShape{}, translate({3. * i, 0, 0}), null);
  auto g = Geometry::build(builder.scene, {builder.scene, builder.files});
  ASSERT_TRUE(g);

  const Coincidence found = find_coincident(*g);

  EXPECT_TRUE(found.any);
  EXPECT_LE(found.marks, g->primitive_count());
  for (const SurfaceInfo& s : g->surfaces) EXPECT_EQ(s.coincident_reach, 1);
}

// Many instances of a group of many shapes: more boxes than can be listed.
TEST(Coincident, AreAssumedIfInstancesMakeTooManyBoxes) {
  constexpr int kShapes = 3'000, kInstances = 3'000;
  SceneBuilder builder({1, 1});
  const BsdfIndex null = builder.null();
  const GroupIndex group = SceneBuilder::push<GroupTag>(builder.scene.groups, ShapeGroup{});
  for (int i = 0; i < kShapes; ++i)
    builder.shape(SphereShape{}, translate({3. * i, 0, 0}), null).group = group;
  for (int i = 0; i < kInstances; ++i) builder.scene.instances.push_back({group, translate({0, 3. * i, 0})});
  auto g = Geometry::build(builder.scene, {builder.scene, builder.files});
  ASSERT_TRUE(g);

  EXPECT_TRUE(find_coincident(*g).any);

  for (const SurfaceInfo& s : g->surfaces) EXPECT_EQ(s.coincident_reach, 1);
}

// A glass body and the fog in it have the same faces: a ray crosses either both or none.
TEST(Coincident, MediaBeginAtTheGlassThatTheyFill) {
  SceneBuilder builder({1, 1});
  HomogeneousMedium m;
  m.sigma_t = {0, 0, 0};
  m.phase = builder.phase(0);
  m.emission = {1, 1, 1};
  const auto fog = SceneBuilder::push<MediumTag>(builder.scene.media, m);
  builder.container(CubeShape{}, {}, builder.null(), fog);
  builder.shape(CubeShape{}, {}, builder.glass(1.0001));
  builder.look({-5, .1, .2}, {0, .1, .2}, 1e-4);
  const auto w = test::world_of(builder);
  int whole = 0;
  for (std::uint64_t s = 0; s < 64; ++s) {
    const double light = render_sample(*w, 0, 0, s).rgb[0];
    // The tolerance includes the share 2.5e-9 that the glass reflects.
    whole += std::abs(light - 2) < 1e-2;
  }
  EXPECT_EQ(whole, 64);
}

// The radiance of a floor under a box of fog of optical depth 1, lit from straight above through a pane in
// one of the box's faces: rho / pi times the transmittances of pane and fog. Parallel light has no noise.
double under_a_pane(BsdfIndex (*pane)(SceneBuilder&), const Transform& at, bool pane_first,
                    const char* integrator, bool instanced = false) {
  SceneBuilder builder({2, 2});
  builder.scene.integrator.name = integrator;
  builder.scene.integrator.max_depth = integrator == std::string_view("path") ? -1 : 2;
  const BsdfIndex bsdf = pane(builder), null = builder.null();
  if (pane_first) builder.shape(RectangleShape{}, at, bsdf);
  Shape& fog = builder.container(CubeShape{}, translate({0, 0, 1.5}) * test::scale(1, 1, .5), null,
                                 builder.homogeneous({1, 1, 1}, {0, 0, 0}));
  if (instanced) {
    fog.group = SceneBuilder::push<GroupTag>(builder.scene.groups, ShapeGroup{});
    builder.scene.instances.push_back({*fog.group, {}});
  }
  if (!pane_first) builder.shape(RectangleShape{}, at, bsdf);
  builder.shape(RectangleShape{}, {}, builder.diffuse(.5));
  builder.scene.emitters.push_back(DirectionalEmitter{{0, 0, -1}, {1, 1, 1}});
  builder.look({-3, .1, .4}, {0, 0, 0});
  return test::estimate(builder, 8, 0, 1).mean[1];
}
BsdfIndex half_mask(SceneBuilder& builder) {
  return builder.bsdf(MaskBsdf{builder.texture({.5, .5, .5}), builder.diffuse(0)});
}
BsdfIndex thin_glass(SceneBuilder& builder) {
  const TextureIndex white = builder.texture({1, 1, 1});
  return builder.bsdf(ThinDielectricBsdf{1.5, 1, white, white});
}

TEST(PaneOnABoundary, DimsShadowRaysWhicheverSurfaceIsHitFirst) {
  const double fog = std::exp(-1.), lit = .5 / test::kPi;
  for (const double face : {1., 2.})
    for (const double aside : {0., 1e-7, -1e-7, 5e-7, -5e-7, 1e-2, -1e-2})
      for (const bool first : {false, true}) {
        SCOPED_TRACE(fmt::format("at {} {:+g}, {}", face, aside, first ? "first" : "last"));
        const Transform at = translate({0, 0, face + aside});
        EXPECT_NEAR(under_a_pane(half_mask, at, first, "volpath"), .5 * fog * lit, 1e-5 * lit);
        EXPECT_NEAR(under_a_pane(half_mask, at, first, "volpath_distant_mis"), .5 * fog * lit, 1e-5 * lit);
        EXPECT_NEAR(under_a_pane(half_mask, at, first, "path"), .5 * lit, 1e-5 * lit);
        EXPECT_NEAR(under_a_pane(half_mask, at, first, "volpath", true), .5 * fog * lit, 1e-5 * lit);
        // With R = .04 for one side, a pane transmits (1 - R) / (1 + R).
        EXPECT_NEAR(under_a_pane(thin_glass, at, first, "volpath"), .96 / 1.04 * fog * lit, 1e-5 * lit);
      }
}

// A room in which a light that lets all light pass coincides with the walls. Whichever of the two surfaces a
// ray meets, the radiance is L + rho L + rho^2 L ... = L / (1 - rho) everywhere.
TEST(LightThatLetsLightPass, LightsTheWallThatItCoincidesWith) {
  for (const double aside : {0., 1e-7, -1e-7, 5e-7, -5e-7})
    for (const bool first : {false, true}) {
      SCOPED_TRACE(fmt::format("{:+g} outside, {}", aside, first ? "first" : "last"));
      SceneBuilder builder;
      const TextureIndex radiance = builder.texture({1, 1, 1});
      const BsdfIndex wall = builder.diffuse(.5), null = builder.null();
      const auto light = [&] {
        Shape& s = builder.shape(CubeShape{}, test::scale(1 + aside), null);
        s.emitter = AreaEmitter{radiance};
        s.flip_normals = true;
      };
      if (first) light();
      builder.shape(CubeShape{}, {}, wall).flip_normals = true;
      if (!first) light();
      builder.look({.1, .2, -.3}, {1, .3, .4}, 60);
      const test::Estimate e = test::estimate(builder, 256, 0, 1);
      EXPECT_NEAR(e.mean[1], 2, 5 * e.standard_error[1]);
      EXPECT_LT(e.standard_error[1], .004);
      EXPECT_EQ(e.health.nonfinite, 0u);
    }
}

// A light on one face of a box of fog, seen either through all of the fog or in front of it.
TEST(LightThatLetsLightPass, LightsTheMediumBoundaryThatItCoincidesWith) {
  for (const double face : {-1., 1.})
    for (const bool first : {false, true}) {
      SCOPED_TRACE(fmt::format("at {}, {}", face, first ? "first" : "last"));
      SceneBuilder builder({2, 2});
      const TextureIndex radiance = builder.texture({1, 1, 1});
      const BsdfIndex null = builder.null();
      const auto light = [&] {
        builder.shape(RectangleShape{}, translate({0, 0, face}), null).emitter = AreaEmitter{radiance};
      };
      if (first) light();
      builder.container(CubeShape{}, {}, null, builder.homogeneous({.5, .5, .5}, {0, 0, 0}));
      if (!first) light();
      builder.look({.1, .2, 5}, {.1, .2, 0}, 1e-3, {0, 1, 0});
      const test::Estimate e = test::estimate(builder, 4096, 0, 1);
      const double seen = face > 0 ? 1 : std::exp(-1.);
      EXPECT_NEAR(e.mean[1], seen, 5 * e.standard_error[1] + 1e-5);
      EXPECT_LT(e.standard_error[1], .004);
    }
}

// ---- shapes that are hidden from different rays

using test::Estimate;
using test::estimate;

enum Rays { kAll, kNotCamera, kCameraAlone, kNotShadow, kNoRays };
void show_to(Shape& s, Rays rays) {
  s.visible_camera = rays != kNotCamera && rays != kNoRays;
  s.visible_shadow = rays != kCameraAlone && rays != kNotShadow && rays != kNoRays;
  s.visible_reflection = s.visible_volume = rays != kCameraAlone && rays != kNoRays;
}

// Two walls in the same place, of different brightness, that the sun lights; or one of them alone.
SceneBuilder walls(const ls::Geometry& g, std::vector<std::pair<double, Rays>> of, bool instanced = false) {
  SceneBuilder builder({4, 4});
  const Transform turn = test::rotate_x(17) * test::rotate_y(31);
  if (instanced) {
    builder.scene.groups.emplace_back();
    builder.scene.instances = {{GroupIndex{0}, turn}};
  }
  for (const auto& [reflectance, rays] : of) {
    Shape& s = builder.shape(g, instanced ? Transform{} : turn, builder.diffuse(reflectance));
    if (instanced) s.group = GroupIndex{0};
    show_to(s, rays);
  }
  builder.scene.emitters.push_back(DirectionalEmitter{{.3, .2, -1}, {3, 3, 3}});
  builder.look({0, 0, 10}, {0, 0, 0}, 4, {0, 1, 0});
  return builder;
}

TEST(CoincidentHidden, ShapesAreFoundOnlyIfDifferentRaysPassThem) {
  const auto found = [](Rays a, Rays b) {
    return test::world_of(walls(RectangleShape{}, {{.2, a}, {.8, b}}))->coincident;
  };
  EXPECT_FALSE(found(kAll, kAll));
  EXPECT_FALSE(found(kNotCamera, kNotCamera));
  EXPECT_TRUE(found(kNotCamera, kAll));
  EXPECT_TRUE(found(kAll, kNotShadow));
  EXPECT_TRUE(found(kNotCamera, kCameraAlone));
}

// In either order of the two. The rounding of the shaded points differs, since rays are moved past both.
TEST(CoincidentHidden, CameraSeesTheShapeThatIsNotHidden) {
  for (const bool ball : {false, true})
    for (const char* integrator : {"volpath", "path", "whitted", "volpath_distant_mis"})
      for (const bool instanced : {false, true})
        for (const bool first : {false, true})
          for (const auto& [hidden, seen] : {std::pair(kNotCamera, kCameraAlone), std::pair(kNoRays, kAll)}) {
            const std::string where =
                fmt::format("{}, {}, {}, {}, {}", ball, integrator, instanced, first, seen == kAll);
            const ls::Geometry g = ball ? ls::Geometry(SphereShape{}) : ls::Geometry(RectangleShape{});
            SceneBuilder alone = walls(g, {{.8, seen}}, instanced);
            SceneBuilder both = first ? walls(g, {{.8, seen}, {.2, hidden}}, instanced)
                                      : walls(g, {{.2, hidden}, {.8, seen}}, instanced);
            for (SceneBuilder* b : {&alone, &both}) {
              b->scene.integrator.name = integrator;
              b->scene.integrator.max_depth = 2;
            }
            const Estimate x = estimate(both, 4), y = estimate(alone, 4);
            EXPECT_NEAR(x.mean[1], y.mean[1], 0x1p-16 * y.mean[1]) << where;
            EXPECT_GT(y.mean[1], .1) << where;
          }
}

TEST(CoincidentHidden, AovsDescribeTheShapeThatIsNotHidden) {
  for (const bool first : {false, true}) {
    SceneBuilder both = first ? walls(RectangleShape{}, {{.8, kCameraAlone}, {.2, kNotCamera}})
                              : walls(RectangleShape{}, {{.2, kNotCamera}, {.8, kCameraAlone}});
    both.scene.film.transparent = true;

    const Picture p(both, {"alpha", "coverage", "albedo", "shape_id"});

    for (std::size_t i = 0; i < p.pixels(); ++i) {
      EXPECT_EQ(p.sum("aov.alpha.A.A", i) + p.sum("aov.alpha.B.A", i), kSamples) << first;
      EXPECT_EQ(p.sum("aov.coverage.A", i), kSamples) << first;
      EXPECT_EQ(p.ids(0, i).slots[0].id, cryptomatte_id(first ? "shape_0" : "shape_1"));
    }
  }
}

// A floor under the sun, and a mask in the same place as a shape that casts no shadow.
TEST(CoincidentHidden, ShadowRaysMeetTheShapeThatIsNotHidden) {
  const auto floor = [](int which) {
    SceneBuilder builder({4, 4});
    builder.shape(RectangleShape{}, test::scale(4), builder.diffuse(.5));
    builder.scene.emitters.push_back(DirectionalEmitter{{.3, .2, -1}, {3, 3, 3}});
    const BsdfIndex half = builder.bsdf(MaskBsdf{builder.texture({.5, .5, .5}), builder.diffuse(0)});
    const auto add = [&](BsdfIndex bsdf, bool shadow) {
      Shape& s = builder.shape(RectangleShape{}, translate({0, 0, 1}) * test::scale(3), bsdf);
      s.visible_camera = false;
      s.visible_shadow = shadow;
    };
    if (which == 1) add(half, true);
    if (which != 0) add(builder.diffuse(0), false);
    if (which != 1) add(half, true);
    builder.look({0, 0, 9}, {0, 0, 0}, 4, {0, 1, 0});
    builder.scene.integrator.max_depth = 2;
    return estimate(builder, 4).mean[1];
  };
  const double alone = floor(0);
  EXPECT_GT(alone, .05);
  for (const int order : {1, 2}) EXPECT_NEAR(floor(order), alone, 0x1p-16 * alone) << order;
}

// A lamp that shadow rays pass, in the place of a black plate that they meet: it lights as without the plate.
TEST(CoincidentHidden, LampInThePlaceOfAnotherShapeGivesItsLight) {
  const auto floor = [](bool plate, bool first) {
    SceneBuilder builder({6, 6});
    builder.shape(RectangleShape{}, test::scale(4), builder.diffuse(.5));
    const Transform at = translate({0, 0, 1}) * test::rotate_x(180);
    const auto add_plate = [&] {
      builder.shape(RectangleShape{}, at, builder.diffuse(0)).visible_camera = false;
    };
    if (plate && first) add_plate();
    Shape& lamp = builder.lamp(RectangleShape{}, at, {5, 4, 3});
    lamp.visible_camera = lamp.visible_shadow = false;
    if (plate && !first) add_plate();
    builder.look({0, 0, 9}, {0, 0, 0}, 20, {0, 1, 0});
    builder.scene.integrator.max_depth = 2;
    return builder;
  };
  const Estimate alone = estimate(floor(false, false), 256, 1);
  for (const bool first : {false, true}) {
    const Estimate both = estimate(floor(true, first), 256, 2);
    EXPECT_NEAR(both.mean[1], alone.mean[1],
                test::kStandardErrors * std::hypot(both.standard_error[1], alone.standard_error[1]))
        << first;
  }
}

// The camera passes both walls of a hidden box and is in the medium of the one that has some.
TEST(CoincidentHidden, MediumInOneOfTwoHiddenBodiesIsSeen) {
  for (const auto& [first, alike] :
       {std::pair(false, false), std::pair(false, true), std::pair(true, false), std::pair(true, true)}) {
    SceneBuilder builder({1, 1});
    const auto box = [&](bool fog) {
      Shape& s = fog ? builder.container(CubeShape{}, {}, builder.diffuse(.5),
                                         builder.homogeneous({.5, .5, .5}, {0, 0, 0}))
                     : builder.shape(CubeShape{}, {}, builder.diffuse(.5));
      s.visible_camera = false;
      if (!fog) s.visible_shadow = alike;
    };
    box(first);
    box(!first);
    builder.scene.film.transparent = true;
    builder.look({0, 0, 5}, {0, 0, 0}, 1e-3, {0, 1, 0});

    const Picture p(builder, {"alpha"});

    EXPECT_NEAR(p.of_all("aov.alpha.A.A") + p.of_all("aov.alpha.B.A"), 1 - std::exp(-1.), kClose) << first;
  }
}

}  // namespace
}  // namespace ls::render
