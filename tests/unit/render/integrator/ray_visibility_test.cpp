// Tests of shapes that shadow rays or scattered rays do not meet, and of lights that surfaces or media do not
// receive: each picture beside one of a scene without the shape or the light.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include "tests/unit/render/integrator/lit_scenes.h"

namespace ls::render {
namespace {

using test::Estimate;
using test::estimate;
using test::SceneBuilder;
using test::translate;
using test::operator*;

TEST(RayVisibility, ShapeHiddenFromShadowRaysCastsNoShadow) {
  for (const char* integrator : kIntegrators)
    for (const NamedLight& light : kLights) {
      const std::string where = fmt::format("{}, {}", integrator, light.name);
      const SceneBuilder bare = floor_under(light, integrator);
      SceneBuilder shaded = bare, lit = bare;
      ball(shaded);
      ball(lit).visible_shadow = false;

      expect_darker(shaded, bare, where);
      expect_same_mean(lit, bare, where);
      if (light.delta) expect_same_samples(lit, bare, where);
    }
}

// A floor of albedo 1/2 under a sky of radiance 1 has radiance 1/2, whatever stands on it without a shadow.
TEST(RayVisibility, FloorUnderTheSkyHasHalfOfItsRadianceWithoutShadows) {
  SceneBuilder builder = floor_under(kLights[4]);
  ball(builder).visible_shadow = false;
  builder.look({0, 0, 9}, {0, 0, 0}, 1e-3, {0, 1, 0});

  const Picture p(builder, {});

  for (std::size_t i = 0; i < p.pixels(); ++i) EXPECT_NEAR(p.whole(1, i) / kSamples, .5, kClose);
}

// Shadow rays decide about direct light: what scattered rays do not meet casts its shadow as ever.
TEST(RayVisibility, ShapeHiddenFromScatteredRaysAloneKeepsItsShadow) {
  for (const char* integrator : kIntegrators)
    for (const NamedLight& light : kLights) {
      const SceneBuilder bare = floor_under(light, integrator);
      SceneBuilder seen = bare, hidden = bare;
      ball(seen);
      Shape& s = ball(hidden);
      s.visible_reflection = s.visible_volume = false;

      expect_same_mean(hidden, seen, fmt::format("{}, {}", integrator, light.name));
    }
}

// A constant environment is found by scattered rays alone; the same one as an image by shadow rays, too.
TEST(RayVisibility, ScatteredRaysAndShadowRaysFindTheSameLight) {
  SceneBuilder sky = floor_under(kLights[4]);
  ball(sky).visible_shadow = false;
  Shape& lid = sky.shape(RectangleShape{}, translate({-1, 0, 1.5}), sky.diffuse(.5));
  lid.visible_reflection = lid.visible_camera = false;
  sky.scene.integrator.max_depth = 4;
  sky.scene.shapes[0].bsdf = metal(sky, .15);  // the lobe crosses kLikeMirror
  SceneBuilder image = sky;
  image.scene.emitters.clear();
  test::add_sky(image, test::SkyImage(8, 4, 1));

  expect_same_mean(image, sky, "rough metal", 4 * kMany);
}

TEST(RayVisibility, MirrorDoesNotShowAShapeHiddenFromScatteredRays) {
  SceneBuilder bare = floor_under(kLights[4]);
  bare.scene.integrator.max_depth = -1;
  bare.scene.shapes[0].bsdf = bare.mirror();
  SceneBuilder seen = bare, hidden = bare, shadowless = bare;
  ball(seen);
  ball(hidden).visible_reflection = false;
  ball(shadowless).visible_shadow = false;

  expect_darker(seen, bare, "mirror");
  expect_same_samples(hidden, bare, "hidden from scattered rays");
  expect_same_samples(shadowless, seen, "hidden from shadow rays");
}

// A share of 4 pi .02^2 = .5 % of a Beckmann lobe of roughness .02 lies where the density is below 1. Shadows
// count there.
TEST(RayVisibility, GlossyFloorShowsNeitherAHiddenShapeNorItsShadow) {
  SceneBuilder bare = floor_under(kLights[4]);
  bare.scene.shapes[0].bsdf = metal(bare, .02);
  SceneBuilder seen = bare, hidden = bare;
  ball(seen);
  ball(hidden).visible_reflection = false;

  const Estimate b = estimate(bare, kMany), h = estimate(hidden, kMany), s = estimate(seen, kMany);

  EXPECT_NEAR(h.mean[1], b.mean[1], .006 * b.mean[1]);
  EXPECT_LT(s.mean[1], .95 * b.mean[1]);
}

TEST(RayVisibility, ShapeHiddenFromAllRaysIsNotThere) {
  for (const char* integrator : kIntegrators) {
    SceneBuilder bare = hall(true, false);
    bare.scene.integrator.name = integrator;
    SceneBuilder hidden = bare;
    Shape& s = hidden.shape(SphereShape{}, translate({-.3, 0, -.2}) * test::scale(.5), hidden.diffuse(.8));
    s.visible_camera = s.visible_shadow = s.visible_reflection = s.visible_volume = false;

    expect_same_mean(hidden, bare, integrator);
  }
}

// ---- media

TEST(RayVisibility, ShapeHiddenFromShadowRaysCastsNoShaft) {
  for (const char* integrator : {"volpath", "volpath_distant_mis"})
    for (const NamedLight& light : kLights)
      for (const int medium : {0, 1, 2}) {
        const std::string where = fmt::format("{}, {}, medium {}", integrator, light.name, medium);
        const SceneBuilder bare = fog_under(light, integrator, medium == 1, medium == 2);
        SceneBuilder shaded = bare, lit = bare, seen = bare;
        ball(shaded);
        ball(lit).visible_shadow = false;
        ball(seen).visible_volume = false;

        if (light.delta) expect_darker(shaded, bare, where);  // of others little is missing
        expect_same_mean(lit, bare, where);
        expect_same_mean(seen, shaded, where);
      }
}

// The light that a medium scattered meets the wall, or passes it.
TEST(RayVisibility, ShapeHiddenFromScatteredRaysOfMediaDoesNotReflectIntoThem) {
  SceneBuilder bare = fog_under(kLights[2], "volpath", false);
  bare.scene.integrator.max_depth = 3;
  SceneBuilder seen = bare, hidden = bare;
  for (SceneBuilder* b : {&seen, &hidden}) {
    Shape& s = b->shape(RectangleShape{}, translate({0, 0, -1.1}) * test::scale(2), b->diffuse(.9));
    s.visible_camera = false;
    s.visible_volume = b == &seen;
  }

  expect_darker(bare, seen, "white wall below the fog");
  expect_same_mean(hidden, bare, "white wall below the fog");
}

// ---- lights

TEST(RayVisibility, LightHiddenFromEverythingLightsNothing) {
  for (const char* integrator : kIntegrators)
    for (const NamedLight& light : kLights) {
      SceneBuilder builder = foggy_floor(integrator);
      const std::size_t shapes = builder.scene.shapes.size();
      light.add(builder);
      hide_light(builder, shapes, false, false);
      builder.scene.film.transparent = true;

      EXPECT_EQ(estimate(builder, 8).mean, (std::array<double, 3>{})) << integrator << ", " << light.name;
    }
}

// Black fog scatters no light, and a black floor none either: what is left is the light of the other.
TEST(RayVisibility, LightHiddenFromMediaLightsSurfacesAlone) {
  for (const char* integrator : {"volpath", "volpath_distant_mis"})
    for (const NamedLight& light : kLights)
      for (const bool volume : {false, true}) {
        const std::string where = fmt::format("{}, {}, {}", integrator, light.name, volume);
        SceneBuilder hidden = foggy_floor(integrator);
        hidden.scene.integrator.max_depth = 2;
        hidden.scene.film.transparent = true;
        const std::size_t shapes = hidden.scene.shapes.size();
        light.add(hidden);
        SceneBuilder black = hidden;
        hide_light(hidden, shapes, !volume, volume);
        if (volume)
          black.scene.shapes[0].bsdf = black.diffuse(0);
        else
          std::get<HomogeneousMedium>(black.scene.media[0]).albedo = {0, 0, 0};

        expect_same_mean(hidden, black, where, 2 * kMany);
        EXPECT_GT(estimate(black, 8).mean[1], 0) << where;
      }
}

// The light of a hidden lamp is missing, and that of the others stays, in paths of any length.
TEST(RayVisibility, LightHiddenFromEverythingLeavesTheOthers) {
  for (const NamedLight& light : kLights) {
    if (std::string(light.name) == "constant") continue;  // hall() has an environment
    const SceneBuilder bare = hall(true, false);
    SceneBuilder hidden = bare;
    const std::size_t shapes = hidden.scene.shapes.size(), emitters = hidden.scene.emitters.size();
    light.add(hidden);
    for (std::size_t i = shapes; i < hidden.scene.shapes.size(); ++i) {
      Shape& s = hidden.scene.shapes[i];
      s.visible_shadow = s.visible_reflection = s.visible_volume = false;
    }
    for (std::size_t i = emitters; i < hidden.scene.emitters.size(); ++i)
      std::visit([](auto& l) { l.visible_reflection = l.visible_volume = false; }, hidden.scene.emitters[i]);
    if (auto* sun = std::get_if<DirectionalEmitter>(&hidden.scene.emitters.back()))
      sun->visible_camera = false;

    expect_same_mean(hidden, bare, light.name, 2 * kMany);
  }
}

// Instances are copies of their shapes, flags included; a mirrored one, too.
TEST(RayVisibility, InstancesHaveTheFlagsOfTheirShapes) {
  const SceneBuilder bare = floor_under(kLights[5]);
  SceneBuilder lit = bare;
  lit.scene.groups.emplace_back();
  Shape& s = lit.shape(SphereShape{}, test::scale(.3), lit.diffuse(.8));
  s.group = GroupIndex{0};
  s.visible_camera = s.visible_shadow = false;
  lit.scene.instances = {{GroupIndex{0}, translate({.6, 0, 1})},
                         {GroupIndex{0}, translate({-.6, 0, 1}) * test::scale(-1)}};
  SceneBuilder shaded = lit;
  shaded.scene.shapes.back().visible_shadow = true;

  expect_darker(shaded, bare, "instances");
  expect_same_mean(lit, bare, "instances");
}

TEST(RayVisibility, TechniquesWithoutItAreLeftOut) {
  const auto techniques = [](bool visible_shadow, bool visible_volume) {
    SceneBuilder builder = hall(false, false);
    builder.scene.shapes[1].visible_shadow = visible_shadow;
    std::get<PointEmitter>(builder.scene.emitters[0]).visible_volume = visible_volume;
    builder.scene.integrator.path_reuse = 16;
    builder.scene.integrator.local_lights = builder.scene.integrator.sky_portals = 1;
    return techniques_of(*test::world_of(builder));
  };
  const TechniqueSet usual = techniques(true, true);
  EXPECT_TRUE(usual.has(Technique::path_reuse));
  EXPECT_TRUE(usual.has(Technique::local_lights));
  for (const auto& [shadow, volume] : {std::pair(false, true), std::pair(true, false)}) {
    const TechniqueSet left = techniques(shadow, volume);
    for (const Technique t : {Technique::path_reuse, Technique::local_lights, Technique::sky_portals,
                              Technique::light_vertices, Technique::sky_samples})
      EXPECT_FALSE(left.has(t)) << shadow << volume;
  }
}

TEST(RayVisibility, LayersOfLightAddUpToTheColour) {
  SceneBuilder builder = hall(true, true);
  Shape& s = builder.shape(SphereShape{}, translate({-.5, 0, -.2}) * test::scale(.4), builder.diffuse(.8));
  s.visible_shadow = false;
  std::get<PointEmitter>(builder.scene.emitters[0]).visible_volume = false;
  std::get<ConstantEmitter>(builder.scene.emitters[1]).visible_reflection = false;

  const Picture p(builder, {"direct", "indirect"});

  // Sums of 16 float32 values, each rounded once more than those of the colour, of like signs
  for (std::size_t i = 0; i < p.pixels(); ++i)
    for (std::size_t c = 0; c < 3; ++c) {
      const double sum = p.sum(fmt::format("aov.direct.{}", "RGB"[c]), i) +
                         p.sum(fmt::format("aov.indirect.{}", "RGB"[c]), i);
      EXPECT_NEAR(sum, p.whole(c, i), 0x1p-18 * p.whole(c, i));
    }
}

}  // namespace
}  // namespace ls::render
