// The room of sunny_room.h with a lamp under the ceiling in place of the sun, in which paths may be shared
// between pixels.
#pragma once

#include "tests/support/sunny_room.h"

namespace ls::test {

struct LampRoom {
  bool glossy = false;
  double fog = 0;
  bool chromatic = false;
  int path_reuse = -1;
  int max_depth = 6;

  SceneBuilder builder(FrameSize size = {16, 16}) const {
    SceneBuilder b =
        SunnyRoom{.glossy = glossy, .sheet = false, .fog = fog, .max_depth = max_depth}.builder(size);
    b.scene.emitters.clear();
    b.environment(.2);
    b.shape(RectangleShape{}, translate({.2, .97, -.1}) * rotate_x(90) * scale(.25), b.diffuse(.5)).emitter =
        AreaEmitter{b.texture({18, 15, 11})};
    b.scene.integrator.path_reuse = path_reuse;
    if (chromatic)
      std::get<HomogeneousMedium>(b.scene.media[0]).sigma_t = {
          static_cast<float>(fog), static_cast<float>(fog) / 4, static_cast<float>(fog) * 3};
    return b;
  }
};

}  // namespace ls::test
