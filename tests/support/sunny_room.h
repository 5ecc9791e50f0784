// A closed room with a slit in one wall, through which the sun shines onto a small part of the floor.
#pragma once

#include <optional>

#include "tests/support/scene_builder.h"

namespace ls::test {

struct SunnyRoom {
  // true: rough metal, plastic and glass are in the room, and a half-transparent sheet is in the slit
  bool glossy = false;
  bool sheet = true;  // false: no sheet in any case
  // The extinction of the air; `grid`: as a grid whose density varies, instead of a constant
  double fog = 0;
  bool grid = false;
  int light_vertices = 0;
  int max_depth = 5;

  SceneBuilder builder(FrameSize size = {16, 16}) const {
    SceneBuilder b(size);
    b.scene.integrator.max_depth = max_depth;
    b.scene.integrator.light_vertices = light_vertices;
    b.scene.integrator.camera_points = -1;
    b.look({-.8, .3, .9}, {.3, -.4, -.6}, 60, {0, 1, 0});
    const BsdfIndex white = b.diffuse(.7), walls = b.bsdf(TwoSidedBsdf{white, white});
    b.shape(RectangleShape{}, translate({0, 0, -1}), walls);
    b.shape(RectangleShape{}, translate({0, 0, 1}), walls);
    b.shape(RectangleShape{}, translate({-1, 0, 0}) * rotate_y(90), walls);
    b.shape(RectangleShape{}, translate({0, 1, 0}) * rotate_x(90), walls);
    b.shape(RectangleShape{}, translate({0, -1, 0}) * rotate_x(90), glossy ? plastic(b) : walls);
    // The wall at x = 1, with an opening from y = 0.1 to 0.4
    b.shape(RectangleShape{}, translate({1, -.45, 0}) * rotate_y(90) * scale(1, .55, 1), walls);
    b.shape(RectangleShape{}, translate({1, .7, 0}) * rotate_y(90) * scale(1, .3, 1), walls);
    if (glossy && sheet)
      b.shape(RectangleShape{}, translate({1, .25, 0}) * rotate_y(90) * scale(1, .15, 1),
              b.bsdf(MaskBsdf{b.texture({.5, .6, .7}), walls}));
    if (glossy) {
      b.shape(SphereShape{{.2, -.7, -.2}, .3}, {}, metal(b));
      b.shape(SphereShape{{-.3, -.6, .3}, .3}, {}, glass(b));
    }
    b.scene.emitters.push_back(DirectionalEmitter{{-1, -1, -.1}, {9, 8, 7}});
    if (fog > 0) {
      const Rgb albedo{.9, .8, .7};
      const MediumIndex air = grid ? b.heterogeneous(b.grid({2, 2, 2}, {1, .5, 1, .5, 1, 1, .5, 1},
                                                            translate({-.99, -.99, -.99}) * scale(1.98)),
                                                     albedo, fog, .4)
                                   : b.homogeneous({fog, fog, fog}, albedo, .4);
      b.container(CubeShape{}, scale(.99), b.null(), air);
      b.scene.sensor.medium = air;
    }
    return b;
  }

  static BsdfIndex plastic(SceneBuilder& b) {
    RoughPlasticBsdf p;
    p.diffuse_reflectance = b.texture({.5, .4, .3});
    p.specular_reflectance = b.texture({1, 1, 1});
    p.alpha = .2;
    const BsdfIndex one = b.bsdf(p);
    return b.bsdf(TwoSidedBsdf{one, one});
  }

 private:
  static BsdfIndex metal(SceneBuilder& b) {
    RoughConductorBsdf m;
    m.alpha_u = m.alpha_v = b.texture({.25, .25, .25});
    m.eta = {.4, .5, 1};
    m.k = {3.7, 2.8, 1.8};
    m.specular_reflectance = b.texture({1, 1, 1});
    return b.bsdf(m);
  }
  static BsdfIndex glass(SceneBuilder& b) {
    RoughDielectricBsdf g;
    g.alpha_u = g.alpha_v = b.texture({.3, .3, .3});
    g.specular_reflectance = g.specular_transmittance = b.texture({1, 1, 1});
    return b.bsdf(g);
  }
};

}  // namespace ls::test
