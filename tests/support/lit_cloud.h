// A cloud on a grid under the sun and a sky of one radiance.
#pragma once

#include "tests/support/scene_builder.h"

namespace ls::test {

inline SceneBuilder lit_cloud(FrameSize size) {
  SceneBuilder b(size);
  b.look({0, 0, 4}, {0, 0, 0}, 30, {0, 1, 0});
  const MediumIndex cloud =
      b.heterogeneous(b.grid({2, 2, 2}, {1, .2, .5, 1, .3, 1, 1, .4}, translate({-1, -1, -1}) * scale(2)),
                      {.9, .95, 1}, 5, .7);
  b.container(CubeShape{}, scale(.99), b.null(), cloud);
  b.scene.emitters.push_back(ConstantEmitter{{.3, .4, .5}});
  b.scene.emitters.push_back(DirectionalEmitter{{.3, -1, -.2}, {3, 3, 3}});
  b.scene.integrator.max_depth = 6;
  b.scene.integrator.light_vertices = -1;
  return b;
}

}  // namespace ls::test
