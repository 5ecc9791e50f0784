// Which techniques a world uses; and that each can be switched off, which does not change the expected image.
#include "core/job/techniques.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "tests/support/fire.h"
#include "tests/support/lamp_room.h"
#include "tests/support/lamp_rooms.h"
#include "tests/support/lit_cloud.h"
#include "tests/support/render_check.h"
#include "tests/support/significance.h"
#include "tests/support/sky_room.h"
#include "tests/support/sky_yard.h"
#include "tests/support/sunny_room.h"

namespace ls::render {
namespace {

using test::scale;
using test::SceneBuilder;
using test::translate;
using test::operator*;

// The camera looks through a box of thin fog at a floor behind it.
SceneBuilder fog() {
  SceneBuilder builder({24, 16});
  builder.look({0, 0, 4}, {0, 0, 0}, 30, {0, 1, 0});
  builder.shape(RectangleShape{}, translate({0, 0, -2}) * scale(4), builder.diffuse(.5));
  const MediumIndex medium = builder.homogeneous({.1, .1, .1}, {.9, .8, .7}, .3);
  builder.container(CubeShape{}, {}, builder.null(), medium);
  builder.scene.integrator.max_depth = 6;
  return builder;
}
SceneBuilder sun_in_fog() {
  SceneBuilder builder = fog();
  builder.scene.emitters.push_back(DirectionalEmitter{{0, -1, -.2}, {3, 3, 3}});
  return builder;
}
SceneBuilder lamp_in_fog() {
  SceneBuilder builder = fog();
  builder.scene.emitters.push_back(PointEmitter{{.3, .2, .1}, {1, 1, 1}});
  return builder;
}
SceneBuilder ball_in_fog() {
  SceneBuilder builder = fog();
  builder.shape(SphereShape{}, translate({.3, .2, .1}) * scale(.2), builder.diffuse(0)).emitter =
      AreaEmitter{builder.texture({1, 1, 1})};
  return builder;
}
SceneBuilder by_segments(SceneBuilder builder) {
  builder.scene.integrator.name = "volpath_distant_mis";
  return builder;
}
SceneBuilder many_lamps() {
  SceneBuilder builder({24, 16});
  builder.look({0, 0, 4}, {0, 0, 0}, 30, {0, 1, 0});
  builder.shape(RectangleShape{}, translate({0, 0, -2}) * scale(4), builder.diffuse(.5));
  for (int i = 0; i < 40; ++i)
    builder.scene.emitters.push_back(PointEmitter{{-2 + .1 * i, 1, -1}, {.1, .1, .1}});
  builder.scene.integrator.max_depth = 3;
  return builder;
}

struct Case {
  Technique technique;
  SceneBuilder builder;
};
std::vector<Case> cases() {
  return {{Technique::equiangular, ball_in_fog()},
          {Technique::equiangular, by_segments(ball_in_fog())},
          {Technique::exponential, by_segments(ball_in_fog())},
          {Technique::camera_points, sun_in_fog()},
          {Technique::lamp_directions, lamp_in_fog()},
          {Technique::lamp_flights, lamp_in_fog()},
          {Technique::light_vertices, test::SunnyRoom{.fog = .3, .light_vertices = 1}.builder({24, 16})},
          {Technique::light_tree, many_lamps()},
          {Technique::path_reuse, test::LampRoom{.fog = .3, .path_reuse = 8}.builder({24, 16})},
          {Technique::shadow_roulette, test::lit_cloud({24, 16})},
          {Technique::sky_samples, test::sky_yard({24, 16})},
          {Technique::path_splitting, test::lit_cloud({24, 16})},
          {Technique::sky_portals, test::SkyRoom{}.builder({24, 16})},
          {Technique::local_lights, test::LampRooms{}.builder({24, 16})},
          {Technique::emissive_grids, test::Fire{}.builder({24, 16})}};
}

// The scene with the parameter set to the value that off_switch() returns.
SceneBuilder switched_off(const Case& c) {
  SceneBuilder out = c.builder;
  IntegratorSettings& i = out.scene.integrator;
  const TechniqueSwitch off = off_switch(c.technique, i.name);
  const std::map<std::string_view, std::function<void()>> parameters{
      {"equiangular", [&] { i.equiangular = -1; }},
      {"lamp_flights", [&] { i.lamp_flights = -1; }},
      {"light_tree", [&] { i.light_tree = -1; }},
      {"phase_only", [&] { i.phase_only = true; }},
      {"camera_points", [&] { i.camera_points = -1; }},
      {"light_vertices", [&] { i.light_vertices = -1; }},
      {"path_reuse", [&] { i.path_reuse = -1; }},
      {"shadow_roulette", [&] { i.shadow_roulette = -1; }},
      {"sky_samples", [&] { i.sky_samples = -1; }},
      {"path_splitting", [&] { i.path_splitting = -1; }},
      {"sky_portals", [&] { i.sky_portals = -1; }},
      {"local_lights", [&] { i.local_lights = -1; }},
      {"emissive_grids", [&] { i.emissive_grids = -1; }},
      {"distance", [&] {
         i.distance =
             off.value == "exponential" ? DistanceSampling::exponential : DistanceSampling::equiangular;
       }}};
  parameters.at(off.parameter)();
  return out;
}

TEST(Techniques, EachIsUsedWhereItPaysAndUnusedWhenSwitchedOff) {
  for (const Case& c : cases()) {
    const std::string name(techniques()[static_cast<std::size_t>(c.technique)].name);
    EXPECT_TRUE(techniques_of(*test::world_of(c.builder)).has(c.technique)) << name;
    EXPECT_FALSE(techniques_of(*test::world_of(switched_off(c))).has(c.technique)) << name;
  }
}

TEST(Techniques, SwitchingOneOffKeepsTheImage) {
  for (const Case& c : cases()) {
    // The pixels of path reuse depend on each other: tests/property/path_reuse_test.cpp tests it
    if (c.technique == Technique::path_reuse) continue;
    const auto with = test::estimate(c.builder, 64), without = test::estimate(switched_off(c), 64);
    for (std::size_t k = 0; k < 3; ++k)
      EXPECT_NEAR(with.mean[k], without.mean[k],
                  test::kStandardErrors * std::hypot(with.standard_error[k], without.standard_error[k]))
          << techniques()[static_cast<std::size_t>(c.technique)].name << " " << k;
  }
}

TEST(Techniques, SceneThatNeedsNoneHasNone) {
  SceneBuilder builder({24, 16});
  builder.shape(RectangleShape{}, {}, builder.diffuse(.5));
  builder.scene.emitters.push_back(PointEmitter{{0, 0, 2}, {1, 1, 1}});
  EXPECT_EQ(techniques_of(*test::world_of(builder)), TechniqueSet{});
}

TEST(Techniques, BitsOfAnotherVersionAreDropped) {
  EXPECT_EQ(TechniqueSet::of_bits(~0u).bits(), (1u << techniques().size()) - 1);
}

}  // namespace
}  // namespace ls::render
