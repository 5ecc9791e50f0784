// The room of sunny_room.h with a sky in place of the sun, whose light comes through the slit in the wall.
#pragma once

#include "tests/support/sunny_room.h"

namespace ls::test {

struct SkyRoom {
  bool image = true;  // a sky with an image beside the constant one
  bool glossy = false;
  double fog = 0;
  bool grid = false;
  int sky_portals = 0;

  SceneBuilder builder(FrameSize size = {16, 16}) const {
    SceneBuilder b =
        SunnyRoom{.glossy = glossy, .fog = fog, .grid = grid, .light_vertices = -1}.builder(size);
    b.scene.emitters.clear();
    b.scene.emitters.push_back(ConstantEmitter{{1, 2, 3}});
    if (image) {
      SkyImage sky(16, 9, 1);
      sky.set(4, 3, {30, 20, 10});  // seen through the slit
      sky.set(12, 2, {5, 10, 40});  // hidden
      add_sky(b, sky);
    }
    b.scene.integrator.sky_portals = sky_portals;
    return b;
  }
};

}  // namespace ls::test
