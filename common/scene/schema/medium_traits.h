// Properties of a medium that follow from its parameters. Grid files are not read.
#pragma once

#include "common/scene/scene.h"

namespace ls::scene {

// They are conservative: false is certain, but true may be wrong, since a grid file may contain only zeros.
// `chromatic` may be wrong in both directions.
struct MediumTraits {
  bool extinguishes = false;  // the extinction is above 0 somewhere
  bool scatters = false;
  bool emits = false;
  bool chromatic = false;     // the extinction differs between channels; the density in a file counts as grey
  bool grids = false;         // some coefficients are volumes
  bool density_file = false;  // the extinction comes from a grid file
};

MediumTraits traits_of(const Medium& medium, const std::vector<Volume>& volumes);

}  // namespace ls::scene
