// A wall, a floor, a ball of plastic and a sheet with holes under a sky of one radiance and a lamp.
#pragma once

#include "tests/support/scene_builder.h"

namespace ls::test {

inline SceneBuilder sky_yard(FrameSize size) {
  SceneBuilder b(size);
  b.look({0, -6, 1.5}, {0, 0, .5}, 40);
  const BsdfIndex grey = b.bsdf(TwoSidedBsdf{b.diffuse(.6), b.diffuse(.6)});
  b.shape(RectangleShape{}, scale(4), grey);
  b.shape(RectangleShape{}, translate({0, 1.5, 1}) * rotate_x(90) * scale(4), grey);
  PlasticBsdf plastic;
  plastic.diffuse_reflectance = b.texture({.5, .3, .2});
  plastic.specular_reflectance = b.texture({1, 1, 1});
  b.shape(SphereShape{{-.8, 0, .5}, .5}, {}, b.bsdf(plastic));
  b.shape(RectangleShape{}, translate({.9, 0, .6}) * rotate_x(70) * scale(.5),
          b.bsdf(MaskBsdf{b.texture({.5, .5, .5}), grey}));
  b.scene.emitters.push_back(ConstantEmitter{{.5, .6, .7}});
  b.lamp(SphereShape{}, translate({1, -1, 3}) * scale(.2), {1, 1, 1});
  b.scene.integrator.max_depth = 5;
  return b;
}

}  // namespace ls::test
