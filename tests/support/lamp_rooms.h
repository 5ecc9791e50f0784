// Two closed rooms with a door between them. The camera is in the left one, and most lamps are in the right
// one.
#pragma once

#include "tests/support/sunny_room.h"

namespace ls::test {

struct LampRooms {
  bool glossy = false;  // the floor is a rough plastic, and a half-transparent sheet hangs in the door
  bool points = false;  // the lamps have no extent
  double fog = 0;       // the extinction of the air
  bool grid = false;    // the air is a grid
  int lamps = 6;        // in the right room
  int local_lights = 0;

  SceneBuilder builder(FrameSize size = {16, 16}) const {
    SceneBuilder b(size);
    b.scene.integrator.max_depth = 5;
    b.scene.integrator.path_reuse = -1;
    b.scene.integrator.hide_emitters = true;
    b.scene.integrator.local_lights = local_lights;
    b.look({-1.8, .4, .9}, {-.6, -.3, -.5}, 70, {0, 1, 0});
    const BsdfIndex white = b.diffuse(.6), walls = b.bsdf(TwoSidedBsdf{white, white});
    for (const double z : {-1., 1.}) b.shape(RectangleShape{}, translate({0, 0, z}) * scale(2, 1, 1), walls);
    for (const double x : {-2., 2.}) b.shape(RectangleShape{}, translate({x, 0, 0}) * rotate_y(90), walls);
    b.shape(RectangleShape{}, translate({0, 1, 0}) * rotate_x(90) * scale(2, 1, 1), walls);
    b.shape(RectangleShape{}, translate({0, -1, 0}) * rotate_x(90) * scale(2, 1, 1),
            glossy ? SunnyRoom::plastic(b) : walls);
    // The wall at x = 0, with a door from z = 0.3 to 0.7
    b.shape(RectangleShape{}, translate({0, 0, -.35}) * rotate_y(90) * scale(.65, 1, 1), walls);
    b.shape(RectangleShape{}, translate({0, 0, .85}) * rotate_y(90) * scale(.15, 1, 1), walls);
    if (glossy)
      b.shape(RectangleShape{}, translate({0, 0, .5}) * rotate_y(90) * scale(.2, 1, 1),
              b.bsdf(MaskBsdf{b.texture({.5, .6, .7}), walls}));
    lamp(b, {-1, .7, -.4}, {3, 4, 5});
    for (int i = 0; i < lamps; ++i) lamp(b, {.3 + 1.5 * i / lamps, .7, -.6 + .3 * (i % 5)}, {6, 5, 4});
    if (fog > 0) {
      const Rgb albedo{.9, .8, .7};
      const MediumIndex air =
          grid ? b.heterogeneous(b.grid({2, 2, 2}, {1, .5, 1, .5, 1, 1, .5, 1},
                                        translate({-1.99, -.99, -.99}) * scale(3.98, 1.98, 1.98)),
                                 albedo, fog, .4)
               : b.homogeneous({fog, fog, fog}, albedo, .4);
      b.container(CubeShape{}, scale(1.99, .99, .99), b.null(), air);
      b.scene.sensor.medium = air;
    }
    return b;
  }

 private:
  void lamp(SceneBuilder& b, const std::array<double, 3>& at, const Rgb& radiance) const {
    constexpr double kRadius = .1, kArea = 3.14 * kRadius * kRadius;
    if (points)
      b.scene.emitters.push_back(PointEmitter{
          {at[0], at[1], at[2]}, {radiance[0] * kArea, radiance[1] * kArea, radiance[2] * kArea}});
    else
      b.shape(SphereShape{{at[0], at[1], at[2]}, kRadius}, {}, b.diffuse(0)).emitter =
          AreaEmitter{b.texture(radiance)};
  }
};

}  // namespace ls::test
