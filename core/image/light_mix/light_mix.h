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
// has not the AOV volume_light_groups, or its alpha has the shadows on shadow catchers and the mix is not
// empty. invalid_argument: a name in the mix is not in `groups`.
Result<std::vector<GroupFactors>> factors_of(const LightMix& mix, AovSet aovs,
                                             std::span<const std::string> groups);

// Sums up the error of a mix over the parts of an image, so that the whole film need not be in memory.
//
// Earlier sums, by which the estimate takes account of skewed noise, are known of the image's colour only. So
// if the colour's error is trusted, the relative error is multiplied by what they change of it. The interval
// is, in proportion, at least as wide as the colour's; an unknown interval stays unknown.
class MixedError {
 public:
  // Returns the mix of `part`, and adds its tiles. Each tile of the image must be added once.
  Film mix(const Film& part, std::span<const GroupFactors> factors);
  bool any() const { return mixed_.samples > 0; }  // false: there are no samples
  ImageError error() const;

 private:
  // errors of the tiles: of the mix, of the colour, and of the colour estimated from its halves alone
  TileError mixed_, colour_, halves_;
};

}  // namespace ls
