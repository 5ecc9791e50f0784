// The light groups of a scene: sets of lights whose light the AOV light_groups has apart.
#pragma once

#include <string>
#include <vector>

#include "core/scene/scene.h"

namespace ls::scene {

// Returns the names of the groups of all emitters and of all media that give off light, sorted, each once. The
// lights without a group are in the group `other`. A scene without light has the group `other` alone.
std::vector<std::string> light_groups_of(const Scene& scene);

// Returns whether the medium gives off light.
bool gives_off_light(const Medium& medium);

}  // namespace ls::scene
