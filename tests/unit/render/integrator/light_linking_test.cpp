// Tests of lights that are linked to receivers and blockers: closed forms, and each picture beside one of a
// scene that is the same without links.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>

#include "core/job/techniques.h"
#include "tests/unit/render/integrator/lit_scenes.h"

namespace ls::render {
namespace {

using test::Estimate;
using test::estimate;
using test::SceneBuilder;
using test::translate;

// The lights that a scene has had added since it was counted.
struct AddedLight {
  explicit AddedLight(const SceneBuilder& b)
      : shapes(b.scene.shapes.size()), emitters(b.scene.emitters.size()) {}
  std::size_t shapes, emitters;

  void link(SceneBuilder& b, const LightLinks& links) const {
    for (std::size_t i = shapes; i < b.scene.shapes.size(); ++i) b.scene.shapes[i].emitter->links = links;
    for (std::size_t i = emitters; i < b.scene.emitters.size(); ++i)
      std::visit([&](auto& l) { l.links = links; }, b.scene.emitters[i]);
  }
};
// Links the light of floor_under() or fog_under(), where all emitters and shapes with light are of one light.
void link(SceneBuilder& b, const LightLinks& links) {
  for (Shape& s : b.scene.shapes)
    if (s.emitter) s.emitter->links = links;
  for (Emitter& e : b.scene.emitters) std::visit([&](auto& l) { l.links = links; }, e);
}

// Returns the radiance of a floor of albedo 1/2 if point lights of this total intensity are 2 above it.
double reflected(double intensity) { return .5 / std::numbers::pi * intensity / 4; }

// ---- receivers

TEST(LightLinking, EachLampLightsTheFloorThatItIsLinkedTo) {
  for (const char* integrator : kIntegrators)
    for (const int floor : {0, 1}) {
      SceneBuilder builder({2, 2});
      for (const double x : {0., 10.})
        builder.shape(RectangleShape{}, translate({x, 0, 0}), builder.diffuse(.5)).link_sets =
            x == 0 ? "left, both" : "both, right";
      for (const double x : {0., 10.}) {
        builder.scene.emitters.emplace_back(PointEmitter{{x, 0, 2}, {1, 1, 1}, {}, true, true, {"left", ""}});
        builder.scene.emitters.emplace_back(
            PointEmitter{{x, 0, 2}, {2, 2, 2}, {}, true, true, {"-left", ""}});
        builder.scene.emitters.emplace_back(
            PointEmitter{{x, 0, 2}, {4, 4, 4}, {}, true, true, {"both, -right", ""}});
        builder.scene.emitters.emplace_back(PointEmitter{{x, 0, 2}, {8, 8, 8}, {}, true, true, {"none", ""}});
        builder.scene.emitters.emplace_back(
            PointEmitter{{x, 0, 2}, {16, 16, 16}, {}, true, true, {"both", ""}});
      }
      builder.look({10. * floor, 0, 9}, {10. * floor, 0, 0}, 1e-3, {0, 1, 0});
      builder.scene.integrator.name = integrator;
      builder.scene.integrator.max_depth = 2;

      const Estimate e = estimate(builder, 1024);

      // The lamps above the other floor are sqrt(104) away, and their light arrives at a cosine of 2 /
      // sqrt(104)
      const double own = reflected(floor == 0 ? 1 + 4 + 16 : 2 + 16), others = 8 / std::pow(104, 1.5);
      EXPECT_NEAR(e.mean[1], own * (1 + others), test::kStandardErrors * e.standard_error[1]) << integrator;
      EXPECT_LT(e.standard_error[1], .02 * own);
    }
}

TEST(LightLinking, LightGivesNothingToWhatItIsNotLinkedTo) {
  for (const char* integrator : kIntegrators)
    for (const NamedLight& light : kLights) {
      const std::string where = fmt::format("{}, {}", integrator, light.name);
      const SceneBuilder bare = floor_under(light, integrator);
      SceneBuilder dark = bare, lit = bare;
      dark.scene.shapes[0].link_sets = lit.scene.shapes[0].link_sets = "floor";
      link(dark, {"-floor", ""});
      link(lit, {"floor", ""});

      EXPECT_EQ(estimate(dark, 8).mean, (std::array<double, 3>{})) << where;
      expect_same_mean(lit, bare, where);
    }
}

// Links to the fog alone, or to all but the fog, have the effect of visible_reflection and visible_volume.
TEST(LightLinking, MediaAreReceiversOfTheirOwn) {
  for (const char* integrator : {"volpath", "volpath_distant_mis"})
    for (const NamedLight& light : kLights)
      for (const bool volume : {false, true}) {
        const std::string where = fmt::format("{}, {}, {}", integrator, light.name, volume);
        SceneBuilder linked = foggy_floor(integrator);
        linked.scene.integrator.max_depth = 3;
        linked.scene.film.transparent = true;
        const AddedLight lights(linked);
        light.add(linked);
        SceneBuilder hidden = linked;
        hide_light(hidden, lights.shapes, !volume, volume);
        std::get<HomogeneousMedium>(linked.scene.media[0]).link_sets = "fog";
        lights.link(linked, {volume ? "fog" : "-fog", ""});

        expect_same_mean(linked, hidden, where, 2 * kMany);
        EXPECT_GT(estimate(linked, 8).mean[1], 0) << where;
      }
}

// A beam that meets one wall alone, which lights the other: the light goes on from its receivers.
TEST(LightLinking, LightGoesOnFromItsReceivers) {
  SceneBuilder bare({6, 6});
  const BsdfIndex white = bare.diffuse(.8);
  bare.shape(RectangleShape{}, {}, white).link_sets = "lit";
  bare.shape(RectangleShape{}, translate({0, 1, 1}) * test::rotate_x(90), white).link_sets = "other";
  bare.scene.emitters.emplace_back(
      SpotEmitter{translate({0, 0, 2}) * test::rotate_x(180), {9, 8, 7}, 15, 15, {}, {}});
  bare.look({0, -6, 1}, {0, 1, 1}, 20);
  SceneBuilder linked = bare, dark = bare;
  link(linked, {"lit", ""});
  link(dark, {"other", ""});

  expect_same_mean(linked, bare, "a beam");
  EXPECT_EQ(estimate(dark, 8).mean, (std::array<double, 3>{}));
}

// A mirror is a receiver, too: what it shows of a light that it does not receive is black.
TEST(LightLinking, MirrorDoesNotShowALightThatItDoesNotReceive) {
  for (const NamedLight& light : kLights) {
    if (light.delta) continue;
    SceneBuilder builder = floor_under(light);
    builder.scene.shapes[0].bsdf = builder.mirror();
    builder.look({0, 0, 2}, {0, 0, 0}, 20, {0, 1, 0});
    SceneBuilder dark = builder;
    dark.scene.shapes[0].link_sets = "mirror";
    link(dark, {"-mirror", ""});

    EXPECT_GT(estimate(builder, 8).mean[1], 0) << light.name;
    EXPECT_EQ(estimate(dark, 8).mean, (std::array<double, 3>{})) << light.name;
  }
}

TEST(LightLinking, CameraSeesALightWhateverItIsLinkedTo) {
  SceneBuilder builder({4, 4});
  builder.lamp(RectangleShape{}, {}, {1, 2, 3});
  builder.look({0, 0, 9}, {0, 0, 0}, 5, {0, 1, 0});
  link(builder, {"none", "none"});

  EXPECT_EQ(estimate(builder, 4).mean, (std::array<double, 3>{1, 2, 3}));
}

// ---- blockers

TEST(LightLinking, LightPassesWhatIsNoBlocker) {
  for (const char* integrator : kIntegrators)
    for (const NamedLight& light : kLights) {
      const std::string where = fmt::format("{}, {}", integrator, light.name);
      const SceneBuilder bare = floor_under(light, integrator);
      SceneBuilder shaded = bare;
      ball(shaded).link_sets = "ball";
      SceneBuilder linked = shaded, lit = shaded;
      link(linked, {"", "ball"});
      link(lit, {"", "-ball"});

      expect_darker(shaded, bare, where);
      expect_same_mean(linked, shaded, where);
      expect_same_mean(lit, bare, where);
      if (light.delta) expect_same_samples(lit, bare, where);
    }
}

TEST(LightLinking, LightPassesWhatIsNoBlockerInMedia) {
  for (const char* integrator : {"volpath", "volpath_distant_mis"})
    for (const NamedLight& light : kLights)
      for (const int medium : {0, 1, 2}) {
        const std::string where = fmt::format("{}, {}, medium {}", integrator, light.name, medium);
        const SceneBuilder bare = fog_under(light, integrator, medium == 1, medium == 2);
        SceneBuilder shaded = bare;
        ball(shaded).link_sets = "ball";
        SceneBuilder linked = shaded, lit = shaded;
        link(linked, {"", "ball"});
        link(lit, {"", "none"});

        expect_same_mean(linked, shaded, where);
        expect_same_mean(lit, bare, where);
      }
}

// A ball shades one light, and a lid the other.
TEST(LightLinking, EachLightHasBlockersOfItsOwn) {
  for (const NamedLight& light : kLights) {
    const auto lit_by = [&](bool one, bool two) {
      SceneBuilder b = floor_under(light);
      // A lamp with a shape would hide the sky.
      std::erase_if(b.scene.shapes, [](const Shape& s) { return s.emitter.has_value(); });
      link(b, {"", "ball"});
      if (!one) b.scene.emitters.clear();
      if (one) ball(b).link_sets = "ball";
      if (!two) return b;
      test::add_sky(b, test::SkyImage(8, 4, .7f));
      std::visit([](auto& sky) { sky.links = {"", "lid"}; }, b.scene.emitters.back());
      Shape& lid = b.shape(RectangleShape{}, translate({-1.2, 0, 1.5}), b.diffuse(0));
      lid.link_sets = "lid";
      lid.visible_camera = false;
      return b;
    };
    const SceneBuilder first = lit_by(true, false);
    if (first.scene.emitters.empty() || std::string(light.name) == "constant") continue;

    const Estimate both = estimate(lit_by(true, true), 4 * kMany, 1), one = estimate(first, 4 * kMany, 2),
                   two = estimate(lit_by(false, true), 4 * kMany, 3);

    EXPECT_NEAR(both.mean[1], one.mean[1] + two.mean[1],
                test::kStandardErrors *
                    std::hypot(both.standard_error[1], one.standard_error[1], two.standard_error[1]))
        << light.name;
  }
}

// A constant environment is found by scattered rays alone; the same one as an image by shadow rays, too.
TEST(LightLinking, ScatteredRaysAndShadowRaysFindTheSameLight) {
  SceneBuilder sky = floor_under(kLights[4]);
  ball(sky).link_sets = "ball";
  Shape& lid = sky.shape(RectangleShape{}, translate({-1, 0, 1.5}), sky.diffuse(.5));
  lid.link_sets = "lid";
  lid.visible_camera = false;
  sky.scene.integrator.max_depth = 4;
  sky.scene.shapes[0].bsdf = metal(sky, .15);  // the lobe crosses kLikeMirror
  SceneBuilder image = sky;
  image.scene.emitters.clear();
  test::add_sky(image, test::SkyImage(8, 4, 1));
  for (const LightLinks& links :
       {LightLinks{"", "-ball"}, LightLinks{"-lid", ""}, LightLinks{"-lid", "lid"}, LightLinks{"lid", ""}}) {
    link(sky, links);
    link(image, links);

    expect_same_mean(image, sky, links.receivers + "; " + links.blockers, 4 * kMany);
  }
}

// In highlights of any sharpness: the density of this lobe is far above kLikeMirror.
TEST(LightLinking, LightPassesWhatIsNoBlockerInHighlights) {
  for (const NamedLight& light : kLights) {
    SceneBuilder bare = floor_under(light);
    bare.scene.shapes[0].bsdf = metal(bare, .02);
    SceneBuilder lit = bare;
    ball(lit).link_sets = "ball";
    link(lit, {"", "-ball"});

    expect_same_mean(lit, bare, light.name, 4 * kMany);
  }
}

TEST(LightLinking, MirrorShowsWhatIsNoBlocker) {
  SceneBuilder bare = floor_under(kLights[4]);
  bare.scene.integrator.max_depth = -1;
  bare.scene.shapes[0].bsdf = bare.mirror();
  SceneBuilder seen = bare;
  ball(seen).link_sets = "ball";
  SceneBuilder linked = seen;
  link(linked, {"", "-ball"});

  expect_darker(seen, bare, "mirror");
  expect_same_samples(linked, seen, "mirror");
}

// A block of opaque shell and depth 2 around a medium that absorbs: light passes the shell, and is absorbed.
TEST(LightLinking, MediumInWhatIsNoBlockerStays) {
  SceneBuilder builder({2, 2});
  builder.shape(RectangleShape{}, test::scale(9), builder.diffuse(.5));
  Shape& block = builder.container(CubeShape{}, translate({0, 0, 3}), builder.diffuse(.5),
                                   builder.homogeneous({.4, .5, .6}, {0, 0, 0}));
  block.link_sets = "block";
  builder.scene.emitters.emplace_back(DirectionalEmitter{{0, 0, -1}, {1, 1, 1}});
  builder.look({0, -9, 1}, {0, 0, 0}, 1e-3);
  builder.scene.integrator.max_depth = 2;
  link(builder, {"", "-block"});

  const Estimate e = estimate(builder, 4);

  const std::array<double, 3> sigma{.4, .5, .6};
  for (std::size_t c = 0; c < 3; ++c)
    EXPECT_NEAR(e.mean[c], .5 / std::numbers::pi * std::exp(-2 * sigma[c]), 8 * kClose);
}

TEST(LightLinking, InstancesHaveTheLinksOfTheirShapes) {
  const SceneBuilder bare = floor_under(kLights[5]);
  SceneBuilder shaded = bare;
  shaded.scene.groups.emplace_back();
  Shape& s = shaded.shape(SphereShape{}, test::scale(.3), shaded.diffuse(.8));
  s.group = GroupIndex{0};
  s.visible_camera = false;
  s.link_sets = "balls";
  shaded.scene.instances = {{GroupIndex{0}, translate({.6, 0, 1})},
                            {GroupIndex{0}, translate({-.6, 0, 1}) * test::scale(-1)}};
  SceneBuilder lit = shaded;
  link(lit, {"", "-balls"});

  expect_darker(shaded, bare, "instances");
  expect_same_mean(lit, bare, "instances");

  SceneBuilder balls = shaded;  // seen, and black unless they receive light
  balls.scene.shapes.back().visible_camera = true;
  balls.scene.shapes[0].bsdf = balls.diffuse(0);
  balls.scene.integrator.max_depth = 2;
  SceneBuilder dark = balls;
  link(dark, {"-balls", ""});
  EXPECT_GT(estimate(balls, 8).mean[1], 0);
  EXPECT_EQ(estimate(dark, 8).mean, (std::array<double, 3>{}));
}

// Where the surface of a blocker lies on that of a shape that is none.
TEST(LightLinking, BlockersShadeWhereTheyLieOnOtherShapes) {
  SceneBuilder bare = floor_under(kLights[2]);
  SceneBuilder shaded = bare;
  for (const char* name : {"one", "two"}) {
    Shape& s = shaded.shape(RectangleShape{}, translate({0, 0, 1}) * test::scale(.7), shaded.diffuse(0));
    s.link_sets = name;
    s.visible_camera = false;
  }
  for (const char* list : {"one", "two", "-one", "-two"}) {
    SceneBuilder linked = shaded;
    link(linked, {"", list});
    expect_same_samples(linked, shaded, list);
  }
  SceneBuilder lit = shaded;
  link(lit, {"", "none"});
  expect_same_samples(lit, bare, "none");
}

// ---- other images, and all together

// The picture of several lights is the sum of the pictures of each.
TEST(LightLinking, LightsAddUp) {
  for (const bool grids : {false, true}) {
    SceneBuilder all = hall(true, grids);
    all.scene.shapes[0].link_sets = "floor";
    all.scene.shapes[1].link_sets = "glass";
    Shape& s = all.shape(SphereShape{}, translate({-.5, 0, -.2}) * test::scale(.4), all.diffuse(.8));
    s.link_sets = "ball";
    std::visit([](auto& m) { m.link_sets = "fog"; }, all.scene.media[0]);
    AreaEmitter& area = *all.scene.shapes[2].emitter;
    auto& point = std::get<PointEmitter>(all.scene.emitters[0]);
    auto& sky = std::get<ConstantEmitter>(all.scene.emitters[1]);
    area.links = {"floor, ball", "floor"};
    point.links = {"fog, glass", "-ball"};
    sky.links = {"-fog", "ball"};
    const TextureIndex black = all.texture({0, 0, 0});
    std::array<double, 3> sum{}, square{};
    for (const int light : {0, 1, 2}) {
      SceneBuilder one = all;
      if (light != 0) one.scene.shapes[2].emitter->radiance = black;
      if (light != 1) std::get<PointEmitter>(one.scene.emitters[0]).intensity = {0, 0, 0};
      if (light != 2) std::get<ConstantEmitter>(one.scene.emitters[1]).radiance = {0, 0, 0};
      const Estimate e = estimate(one, 8 * kMany, static_cast<std::uint64_t>(2 + light));
      for (std::size_t c = 0; c < 3; ++c) {
        sum[c] += e.mean[c];
        square[c] += e.standard_error[c] * e.standard_error[c];
      }
    }

    const Estimate e = estimate(all, 8 * kMany, 1);

    for (std::size_t c = 0; c < 3; ++c)
      EXPECT_NEAR(e.mean[c], sum[c],
                  test::kStandardErrors * std::sqrt(square[c] + e.standard_error[c] * e.standard_error[c]));
  }
}

TEST(LightLinking, ShadowCatchersMissTheLightThatTheyReceive) {
  const auto alpha = [](const LightLinks& links) {
    SceneBuilder builder({2, 2});
    Shape& floor = builder.shape(RectangleShape{}, test::scale(20), builder.diffuse(.5));
    floor.shadow_catcher = true;
    floor.link_sets = "floor";
    builder.shape(RectangleShape{}, translate({0, 0, 1}), builder.diffuse(.5)).link_sets = "roof";
    builder.look({0, -30, 10}, {0, 0, 0}, 1e-3);
    builder.scene.film.transparent = true;
    // Without links half of the light is in the shadow of the roof.
    builder.scene.emitters.emplace_back(DirectionalEmitter{{0, 0, -1}, {1, 1, 1}});
    const double steep = std::sqrt(5);
    builder.scene.emitters.emplace_back(DirectionalEmitter{{2, 0, -1}, {steep, steep, steep}});
    std::get<DirectionalEmitter>(builder.scene.emitters[0]).links = links;
    const Picture p(builder, {"alpha", "shadow_catcher"}, 1024);
    double lit = 0, unlit = 0;
    for (std::size_t i = 0; i < p.pixels(); ++i)
      for (const char h : {'A', 'B'}) {
        lit += p.sum(fmt::format("aov.shadow_catcher.{}.L", h), i);
        unlit += p.sum(fmt::format("aov.shadow_catcher.{}.U", h), i);
      }
    return 1 - lit / unlit;
  };
  // 4096 choices between two lights: the standard error of the share is 1/128
  EXPECT_NEAR(alpha({}), .5, test::kStandardErrors / 128);
  EXPECT_EQ(alpha({"", "-roof"}), 0);
  EXPECT_EQ(alpha({"-floor", ""}), 0);
  EXPECT_NEAR(alpha({"floor", "roof"}), .5, test::kStandardErrors / 128);
}

TEST(LightLinking, TechniquesWithoutItAreLeftOut) {
  SceneBuilder builder = hall(false, false);
  builder.scene.integrator.path_reuse = 16;
  builder.scene.integrator.local_lights = builder.scene.integrator.sky_portals = 1;
  EXPECT_TRUE(techniques_of(*test::world_of(builder)).has(Technique::path_reuse));
  for (const LightLinks& links : {LightLinks{"-floor", ""}, LightLinks{"", "-floor"}}) {
    SceneBuilder linked = builder;
    linked.scene.shapes[0].link_sets = "floor";
    std::get<PointEmitter>(linked.scene.emitters[0]).links = links;
    const TechniqueSet left = techniques_of(*test::world_of(linked));
    for (const Technique t : {Technique::path_reuse, Technique::local_lights, Technique::sky_portals,
                              Technique::light_vertices, Technique::sky_samples})
      EXPECT_FALSE(left.has(t));
  }
}

}  // namespace
}  // namespace ls::render
