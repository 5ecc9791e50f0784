// A mix of light groups: factors of the light of each group, as if its lamps were brighter or of another
// colour.
#pragma once

#include <array>
#include <map>
#include <string>
#include <string_view>

#include "core/base/error.h"

namespace ls {

// The largest factor of a mix. Factors are finite and not negative.
inline constexpr double kMostMixFactor = 1e6;

// Factors of a light group's light, R G B: of the light that was last scattered in a medium (`volume`), and
// of all other light.
struct GroupFactors {
  std::array<double, 3> surface{1, 1, 1}, volume{1, 1, 1};
  bool operator==(const GroupFactors&) const = default;
};

// Factors by the names of light groups. A group that is not in the map has the factor 1.
struct LightMix {
  std::map<std::string, GroupFactors> groups;
  bool operator==(const LightMix&) const = default;
};

// Parses a mix in one of two notations.
// - "key=2,fill=0.5:0.4:0.3,fog.volume=4": one factor or three (R, G, B), for a group or for its `.surface`
// or
//   `.volume` alone. `volume` is for light that was last scattered in a medium, `surface` for all other
//   light.
// - A JSON object whose keys are names of groups. A value is a number, a list of three, or an object with the
//   keys `surface` and `volume`, each with such a value.
Result<LightMix> parse_light_mix(std::string_view text);
std::string to_string(const LightMix& mix);       // in the first notation
std::string canonical_json(const LightMix& mix);  // in the second

// Returns the mix that multiplies by both.
LightMix product(const LightMix& first, const LightMix& second);

}  // namespace ls
