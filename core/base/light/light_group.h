// The names of light groups: sets of lights whose light has layers of its own in an image.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace ls {

// Largest number of light groups of an image, the group `other` included, and the most bytes of a group's
// name.
inline constexpr std::size_t kMostLightGroups = 32, kMostLightGroupBytes = 63;
// The group of the lights that are in no other group.
inline constexpr std::string_view kOtherLightGroup = "other";

// Returns why this cannot be the name of a light group, or an empty text. A name has ASCII letters, digits,
// '_' and '-'.
std::string wrong_light_group(std::string_view name);

}  // namespace ls
