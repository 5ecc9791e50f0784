// The light groups of an image: sets of lights whose light the AOV light_groups has apart.
#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>
#include <span>
#include <string>

#include "core/base/light/light_group.h"

namespace ls::render {

using LightGroup = std::uint8_t;  // index in RenderSettings::light_groups
inline constexpr LightGroup kNoLightGroup = std::numeric_limits<LightGroup>::max();
static_assert(kMostLightGroups < kNoLightGroup);

// Returns the index of the group of this name, empty for `other`. A name that is not in `groups` has the
// index of `other`, or kNoLightGroup if that is not in `groups` either. `groups` must be sorted.
inline LightGroup light_group_of(std::span<const std::string> groups, const std::string& name) {
  for (const std::string_view wanted : {std::string_view(name), kOtherLightGroup}) {
    const auto at = std::ranges::lower_bound(groups, wanted);
    if (at != groups.end() && *at == wanted) return static_cast<LightGroup>(at - groups.begin());
  }
  return kNoLightGroup;
}

}  // namespace ls::render
