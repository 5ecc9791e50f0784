// The image of shapes that move is the mean of those of shapes that stand where they pass.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>

#include "tests/property/stills.h"
#include "tests/support/significance.h"
#include "worker/render/world/world.h"

namespace ls::test {
namespace {

struct Change {
  const char* name;
  std::function<void(SceneBuilder&)> change;
};

// A room with a lamp and a ball, without fog.
SceneBuilder room_without_fog() {
  SceneBuilder b(FrameSize{kSide, kSide});
  b.scene.integrator.max_depth = 4;
  b.shape(CubeShape{}, scale(2, 1, 1), b.diffuse(.7)).flip_normals = true;
  b.shape(SphereShape{}, translate({.6, -.6, .3}) * scale(.3), b.bsdf(DiffuseBsdf{b.texture({.6, .2, .1})}));
  b.lamp(RectangleShape{}, translate({.3, .98, 0}) * rotate_x(90) * scale(.3), {4, 5, 6});
  b.scene.sensor.to_world = look_at({-1.6, .1, -.5}, {.5, -.2, 0}, {0, 1, 0});
  b.scene.sensor.fov = 70;
  return b;
}

const Transform kBegin = translate({-.5, -.5, .5}) * rotate_y(10) * scale(.3),
                kMiddle = translate({.2, .2, -.3}) * rotate_x(60) * scale(.3),
                kEnd = translate({.9, -.3, -.5}) * rotate_x(140) * rotate_y(70) * scale(.4);

void fill_with_fog(SceneBuilder& b) {
  const MediumIndex air = b.homogeneous({.3, .3, .3}, {.9, .8, .7}, .4);
  b.container(CubeShape{}, scale(1.97, .97, .97), b.null(), air);
  b.scene.sensor.medium = air;
}

TEST(ShapeMotion, GivesTheMeanOfStills) {
  Tests tests("property/shape_motion");
  const auto ball = [](SceneBuilder& b) {
    move(b.scene, b.shape(SphereShape{}, {}, b.diffuse(.8)), {kBegin, kMiddle, kEnd});
  };
  const auto box = [](SceneBuilder& b) {
    move(b.scene, b.shape(CubeShape{}, {}, b.mirror()), {kBegin, kMiddle, kEnd});
  };
  const auto in_fog = [](SceneBuilder& b) {
    fill_with_fog(b);
    move(b.scene, b.shape(CylinderShape{}, {}, b.diffuse(.8)), {kBegin, kMiddle, kEnd});
    move(b.scene, b.shape(DiskShape{}, {}, b.diffuse(.6)),
         {translate({.5, .3, 0}) * scale(.6), translate({.5, .3, .3}) * rotate_y(90) * scale(.6)});
  };
  const auto group = [](SceneBuilder& b) {
    const auto index = SceneBuilder::push<GroupTag>(b.scene.groups, ShapeGroup{});
    const BsdfIndex pane = b.bsdf(MaskBsdf{b.texture({.5, .5, .5}), b.diffuse(.8)});
    std::vector<Shape> own = std::exchange(b.scene.shapes, {});
    b.shape(CubeShape{}, translate({0, 1, 0}) * scale(.5), b.diffuse(.7)).group = index;
    b.shape(RectangleShape{}, translate({0, -1, 0}) * scale(1.5), pane).group = index;
    b.scene.shapes.insert(b.scene.shapes.end(), own.begin(), own.end());
    move(b.scene, b.scene.instances.emplace_back(Instance{index, {}, {}}), {kBegin, kMiddle, kEnd});
  };
  const auto cloud = [](SceneBuilder& b) {
    const MediumIndex fog = b.homogeneous({3, 4, 5}, {.9, .8, .7}, .4);
    move(b.scene, b.container(SphereShape{}, {}, b.null(), fog), {kBegin, kMiddle, kEnd});
  };
  const auto cloud_in_fog = [](SceneBuilder& b) {
    fill_with_fog(b);
    const MediumIndex fog = b.homogeneous({3, 3, 3}, {.9, .8, .7}, .4);
    move(b.scene, b.container(CubeShape{}, {}, b.null(), fog), {kBegin, kMiddle, kEnd});
  };
  const auto grid = [](SceneBuilder& b) {
    std::vector<float> density;
    for (int i = 0; i < 27; ++i) density.push_back(.5f * static_cast<float>(i % 5));
    const VolumeIndex v = b.grid({3, 3, 3}, density, translate({-2, -1, -1}) * scale(4, 2, 2));
    move(b.scene, b.container(CubeShape{}, {}, b.null(), b.heterogeneous(v, {.9, .8, .7})), {kBegin, kEnd});
  };
  const auto camera_too = [](SceneBuilder& b) {
    move(b.scene, b.shape(CubeShape{}, {}, b.diffuse(.8)), {kBegin, kEnd});
    move(b.scene, b.scene.sensor,
         {look_at({-1.6, .1, -.5}, {.5, -.2, 0}, {0, 1, 0}),
          look_at({-1.2, .5, .6}, {.6, -.6, .2}, {.3, 1, 0})});
  };
  const auto lamps = [](SceneBuilder& b) {
    move(b.scene, b.lamp(RectangleShape{}, {}, {2, 1, 3}), {kBegin, kMiddle});
    move(b.scene, b.lamp(SphereShape{}, {}, {1, 2, 1}),
         {translate({.9, 0, .2}) * scale(.1), translate({.2, .5, .6}) * scale(.2)});
  };
  const auto lamps_in_fog = [&](SceneBuilder& b) {
    fill_with_fog(b);
    lamps(b);
    b.scene.integrator.equiangular = 0;
    move(b.scene, b.lamp(CubeShape{}, {}, {.5, .5, .5}), {kMiddle, kEnd});
  };
  const auto distant = [&](SceneBuilder& b) {
    b.scene.integrator.name = "volpath_distant_mis";
    lamps_in_fog(b);
  };
  const auto left_out = [&](SceneBuilder& b) {
    ball(b);
    b.scene.integrator.path_reuse = 8;
    b.scene.integrator.local_lights = 1;
  };
  const Change shots[] = {{"a ball", ball},
                          {"a box of mirrors", box},
                          {"a cylinder and a disk in fog", in_fog},
                          {"an instance of a group with a mask", group},
                          {"a ball of fog", cloud},
                          {"a box of fog in fog", cloud_in_fog},
                          {"a boundary that moves over a grid", grid},
                          {"a camera and a box", camera_too},
                          {"lamps", lamps},
                          {"lamps in fog", lamps_in_fog},
                          {"lamps in fog, by points along segments", distant},
                          {"techniques that are left out", left_out}};
  const double level = tests.level(std::size(shots) * kQuarters);
  for (const Change& shot : shots) {
    SceneBuilder b = room_without_fog();
    shot.change(b);
    expect_mean_of_stills(shot.name, level, b);
  }
  tests.close();
}

}  // namespace
}  // namespace ls::test
