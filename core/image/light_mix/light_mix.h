// A mix of an image's light groups: an image in which the light of each group is multiplied by factors, as if
// its lamps were brighter or of another colour. Light adds up, so a mix is the image of the scene with such
// lamps, and the difference between its two halves of samples has the error that belongs to it, with the
// covariances of the groups.
#pragma once

#include <array>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/error.h"
#include "core/image/film/film.h"

namespace ls {

// The largest factor of a mix. Factors are finite and not negative.
inline constexpr double kMostMixFactor = 1e6;

// Factors by the names of light groups. A group that is not in the map has the factor 1.
struct LightMix {
  std::map<std::string, GroupFactors> groups;
  bool operator==(const LightMix&) const = default;
};

// Parses a mix: a JSON object whose keys are names of groups. A value is a number, a list of three numbers
// (R, G, B), or an object with the keys `surface` and `volume`, each with such a value: `volume` is for light
// that was last scattered in a medium, `surface` for all other light; the one that is missing is 1.
Result<LightMix> parse_light_mix(std::string_view json);
// Parses the notation of the command line: "key=2,fill=0.5:0.4:0.3,fog.volume=4", with one factor or three (R,
// G, B), for a group or for its `.surface` or `.volume` alone.
Result<LightMix> parse_light_mix_option(std::string_view text);
std::string canonical_json(const LightMix& mix);

// Returns the factors of each light group of an image with these AOVs. `groups` are the names of its groups.
// failed_precondition: the image has no light groups, or factors differ between `surface` and `volume` and it
// has not the AOV volume_light_groups. invalid_argument: a name in the mix is not in `groups`.
Result<std::vector<GroupFactors>> factors_of(const LightMix& mix, AovSet aovs,
                                             std::span<const std::string> groups);

// Returns the error of a mixed image (Film::mixed()) with this sum of the errors of its tiles. `colour` is the
// error of the image before mixing. The relative width of the mix's interval is at least that of the colour's:
// only of the colour the film knows earlier sums, by which the interval takes account of skewed noise.
ImageError mixed_error(const TileError& mixed, const ImageError& colour);

}  // namespace ls
