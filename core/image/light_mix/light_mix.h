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

// Returns the error of a mixed image (Film::mixed()) with this sum of the errors of its tiles. `colour` is
// the error of the image before mixing. The relative width of the mix's interval is at least that of the
// colour's: only of the colour the film knows earlier sums, by which the interval takes account of skewed
// noise.
ImageError mixed_error(const TileError& mixed, const ImageError& colour);

}  // namespace ls
