// The image of a camera that moves is the mean of those of cameras that stand where it passes.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>

#include "tests/property/stills.h"
#include "tests/support/significance.h"
#include "worker/render/world/world.h"

namespace ls::test {
namespace {

struct Shot {
  const char* name;
  std::function<void(SceneBuilder&)> change = [](SceneBuilder&) {};
  const char* variant = "";
};

// A room of fog with a lamp, before which the camera moves aside, turns and rises.
SceneBuilder room() {
  SceneBuilder b(FrameSize{kSide, kSide});
  b.scene.integrator.max_depth = 4;
  const BsdfIndex white = b.diffuse(.7), red = b.bsdf(DiffuseBsdf{b.texture({.6, .2, .1})});
  b.shape(CubeShape{}, scale(2, 1, 1), white).flip_normals = true;
  b.shape(SphereShape{}, translate({.6, -.6, .3}) * scale(.35), red);
  b.lamp(RectangleShape{}, translate({.3, .98, 0}) * rotate_x(90) * scale(.3), {4, 5, 6});
  const MediumIndex air = b.homogeneous({.3, .3, .3}, {.9, .8, .7}, .4);
  b.container(CubeShape{}, scale(1.97, .97, .97), b.null(), air);
  b.scene.sensor.medium = air;
  return b;
}

TEST(CameraMotion, GivesTheMeanOfStills) {
  Tests tests("property/camera_motion");
  const auto lens = [](SceneBuilder& b) {
    b.scene.sensor.aperture_radius = .1;
    b.scene.sensor.focus_distance = 1.5;
  };
  const auto orthographic = [](SceneBuilder& b) {
    Sensor& s = b.scene.sensor;
    s.projection = Projection::orthographic;
    s.near_clip = 1e-3;
    move(b.scene, s,
         {look_at({-1.5, .1, 0}, {1, 0, 0}, {0, 1, 0}) * scale(.5, .5, 1),
          look_at({-1.5, .1, .2}, {1, -.3, 0}, {0, 1, 0}) * scale(.6, .4, 1)});
  };
  const auto around = [](SceneBuilder& b) { b.scene.sensor.projection = Projection::spherical; };
  const auto shared = [](SceneBuilder& b) { b.scene.integrator.path_reuse = 8; };
  const auto grid = [](SceneBuilder& b) {
    std::vector<float> density;
    for (int i = 0; i < 27; ++i) density.push_back(.1f * static_cast<float>(i % 5));
    const VolumeIndex v =
        b.grid({3, 3, 3}, density, translate({-1.97, -.97, -.97}) * scale(2 * 1.97, 2 * .97, 2 * .97));
    b.scene.media[0] = b.scene.media[b.heterogeneous(v, {.9, .8, .7}).value];
    b.scene.media.pop_back();
  };
  const auto sun = [](SceneBuilder& b) {  // through the ceiling, which is taken away with its lamp
    b.scene.shapes.erase(b.scene.shapes.begin());
    b.scene.emitters.push_back(DirectionalEmitter{{.3, -1, .2}, {1, 1, 1}});
    b.scene.integrator.light_vertices = 1;
  };
  const Shot shots[] = {
      {"fog"},
      {"a thin lens", lens},
      {"orthographic", orthographic},
      {"spherical", around},
      {"a grid", grid},
      {"shared paths", shared, "shared"},
      {"a sun, connected", sun, "connected"},
  };
  const double level = tests.level(std::size(shots) * kQuarters);
  for (const Shot& shot : shots) {
    SceneBuilder b = room();
    b.scene.sensor.fov = 70;
    move(
        b.scene, b.scene.sensor,
        {look_at({-1.6, .1, -.5}, {.5, -.2, 0}, {0, 1, 0}), look_at({-1.5, .3, 0}, {.6, -.2, .3}, {.2, 1, 0}),
         look_at({-1.2, .5, .6}, {.6, -.6, .2}, {.3, 1, 0})});
    shot.change(b);
    ASSERT_THAT(estimate(b, 2).variant, testing::HasSubstr(shot.variant)) << shot.name;
    expect_mean_of_stills(shot.name, level, b);
  }
  tests.close();
}

}  // namespace
}  // namespace ls::test
