// Mixes of an image's light groups (core/base/light/light_mix.h). Light adds up, so a mix is the image of the
// scene with such lamps, and the difference between its two halves of samples has the error that belongs to
// it, with the covariances of the groups.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "core/base/error.h"
#include "core/base/light/light_mix.h"
#include "core/image/film/film.h"

namespace ls {

// Returns the factors of each light group of an image with these AOVs. `groups` are the names of its groups.
// failed_precondition: the image has no light groups, or factors differ between `surface` and `volume` and it
// has not the AOV volume_light_groups. invalid_argument: a name in the mix is not in `groups`.
Result<std::vector<GroupFactors>> factors_of(const LightMix& mix, AovSet aovs,
                                             std::span<const std::string> groups);

// Returns the error of a mix of `film` whose tiles have this sum of errors. Earlier sums, by which the
// estimate takes account of skewed noise, are known of the film's colour only. So the relative error is
// multiplied by what they change of the colour's, and the interval is, in proportion, at least as wide as the
// colour's.
ImageError mixed_error(const Film& film, const TileError& mixed);

}  // namespace ls
