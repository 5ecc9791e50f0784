// A random scene out of describe.h: any plugin with any parameters, put together so that rays meet something.
#pragma once

#include "tests/property/random_assets.h"

namespace ls::test {

struct SceneChoice {
  // How probable it is that a number lies at the end of its range, is denormal, huge, ...; 0: a scene that
  // someone could have meant, whose light is of the order of 1.
  double wild = 0;
  // Numbers that leave integrators little to disagree about but how they work: no narrow cameras, no depth
  // limit beyond the first few scatterings.
  bool calm = false;
};

struct RandomScene {
  std::uint64_t seed = 0;
  SceneChoice choice;
  Scene scene;  // consistent and compacted
  RandomAssets assets;
};

RandomScene random_scene(std::uint64_t seed, const SceneChoice& choice);
// As the property tests choose: two of five tame.
SceneChoice random_choice(std::uint64_t seed);

}  // namespace ls::test
