// Scenes of different structure for the metamorphic tests: every kind of medium, boundary and light.
#pragma once

#include <string>
#include <vector>

#include "tests/support/scene_builder.h"

namespace ls::test {

struct NamedScene {
  std::string name;
  SceneBuilder builder;
};
// Their coordinates are short binary fractions.
std::vector<NamedScene> different_scenes();

// The emitters without a shape that may stand twice: all but environments.
bool may_stand_twice(const Emitter& e);
void dim(Emitter& e, double by);

}  // namespace ls::test
