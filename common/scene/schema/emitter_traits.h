// Properties of an emitter without a shape that follow from its parameters.
#pragma once

#include <optional>

#include "common/scene/scene.h"

namespace ls::scene {

struct EmitterTraits {
  bool dark = false;             // true if it emits no light
  bool delta = false;            // true if it has no extent, so that no ray can hit it
  std::optional<Vec3> position;  // its position in the world; nullopt: infinitely far
};

EmitterTraits traits_of(const Emitter& emitter, const std::vector<Texture>& textures);

}  // namespace ls::scene
