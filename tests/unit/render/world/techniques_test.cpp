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
// The camera does not see the lamps, whose edges would be most of the noise.
SceneBuilder lamp_in_fog() {
  SceneBuilder builder = fog();
  builder.scene.emitters.push_back(PointEmitter{{.2, .95, .1}, {1, 1, 1}});
  return builder;
}
SceneBuilder ball_in_fog() {
  SceneBuilder builder = fog();
  builder.shape(SphereShape{}, translate({.2, .95, .1}) * scale(.22), builder.diffuse(0)).emitter =
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

// The camera sees the sky beside the cloud, so that paths split in the cloud.
SceneBuilder cloud_over_ground() {
  SceneBuilder builder = test::lit_cloud({24, 16});
  builder.look({0, 0, 4}, {0, 0, 0}, 60, {0, 1, 0});
  builder.shape(RectangleShape{}, translate({0, -1.2, 0}) * test::rotate_x(-90) * scale(6),
                builder.diffuse(.1));
  builder.scene.integrator.rr_depth = 2;
  return builder;
}
SceneBuilder direct(SceneBuilder builder) {
  builder.scene.integrator.max_depth = 2;
  return builder;
}

struct Case {
  Technique technique;
  SceneBuilder builder;
  std::uint64_t with = 256, without = 256;  // samples per pixel that suffice with and without it
};
std::vector<Case> cases() {
  return {{Technique::equiangular, ball_in_fog(), 512, 6144},
          {Technique::equiangular, by_segments(ball_in_fog())},
          {Technique::exponential, by_segments(ball_in_fog())},
          {Technique::camera_points, sun_in_fog()},
          {Technique::lamp_directions, lamp_in_fog(), 1024, 2048},
          {Technique::lamp_flights, lamp_in_fog()},
          {Technique::light_vertices, test::SunnyRoom{.fog = .3, .light_vertices = 1}.builder({24, 16})},
          {Technique::light_tree, many_lamps()},
          {Technique::path_reuse, test::LampRoom{.fog = .3, .path_reuse = 8}.builder({24, 16})},
          {Technique::shadow_roulette, test::lit_cloud({24, 16})},
          {Technique::sky_samples, test::sky_yard({24, 16})},
          {Technique::path_splitting, cloud_over_ground(), 768, 1024},
          {Technique::sky_portals, test::SkyRoom{.image = false}.builder({24, 16}), 1024, 4096},
          {Technique::local_lights, direct(test::LampRooms{}.builder({24, 16})), 1536, 1536},
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

// Those whose images are tested elsewhere with the same power: their pixels depend on each other, or without
// them the noise is too large.
bool tested_elsewhere(Technique t) {
  return t == Technique::path_reuse ||      // tests/property/path_reuse_test.cpp
         t == Technique::light_vertices ||  // tests/property/connections_test.cpp
         t == Technique::emissive_grids;    // emissive_grids_test.cpp
}

TEST(Techniques, SwitchingOneOffKeepsTheImage) {
  for (const Case& c : cases()) {
    if (tested_elsewhere(c.technique)) continue;
    const std::string name(techniques()[static_cast<std::size_t>(c.technique)].name);
    const auto with = test::half_images(c.builder, c.with),
               without = test::half_images(switched_off(c), c.without);
    const test::Estimate plain = test::estimate(without), change = test::difference(with, without);
    for (std::size_t k = 0; k < 3; ++k) {
      EXPECT_GT(change.standard_error[k], 0) << name << " changes nothing";
      const double room =
          cli::student_quantile(test::kSingleFigure, change.freedom[k]) * change.standard_error[k];
      EXPECT_LT(std::abs(change.mean[k]), room) << name << ", channel " << k << " of " << plain.mean[k];
      EXPECT_LT(room, test::kBiasSeen * plain.mean[k]) << name << ": the test has no power";
    }
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
