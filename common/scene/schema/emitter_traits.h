// Properties of an emitter without a shape that follow from its parameters.
#pragma once

#include <optional>

#include "common/scene/scene.h"

namespace ls::scene {

struct EmitterTraits {
  bool dark = false;             // it gives off no light
  bool delta = false;            // it has no extent: no ray can hit it
  std::optional<Vec3> position;  // where it stands, in the world; nullopt: infinitely far
};

EmitterTraits traits_of(const Emitter& emitter, const std::vector<Texture>& textures);

}  // namespace ls::scene
