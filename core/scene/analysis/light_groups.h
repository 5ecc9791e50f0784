// The light groups of a scene: sets of lights whose light the AOV light_groups has apart.
#pragma once

#include <string>
#include <vector>

#include "core/base/error.h"
#include "core/base/light/light_mix.h"
#include "core/scene/scene.h"

namespace ls::scene {

// Returns the names of the groups of all emitters and of all media that give off light, sorted, each once.
// The lights without a group are in the group `other`. A scene without light has the group `other` alone.
std::vector<std::string> light_groups_of(const Scene& scene);

// Returns whether the medium gives off light.
bool gives_off_light(const Medium& medium);

// Multiplies the light of the scene's light groups by the factors of the mix. invalid_argument: the scene has
// no group of a name in the mix, or a light cannot have such factors: factors of media differ from those of
// surfaces, or a colour is asked of a light that has no place for it (an environment map, a projector, a
// medium whose emission is a grid).
Result<void> multiply_light(const LightMix& mix, Scene& scene);

}  // namespace ls::scene
