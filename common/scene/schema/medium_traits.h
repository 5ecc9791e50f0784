// Properties of a medium that follow from its parameters. Grid files are not read.
#pragma once

#include "common/scene/scene.h"

namespace ls::scene {

// False is certain; true may turn out to be false, since a grid file may hold nothing but zeros.
struct MediumTraits {
  bool extinguishes = false;  // extinction is above 0 somewhere
  bool scatters = false;
  bool emits = false;
  bool chromatic = false;     // extinction differs between colour channels; false for grid files
  bool grids = false;         // coefficients are volumes
  bool density_file = false;  // extinction comes from a grid file
};

MediumTraits traits_of(const Medium& medium, const std::vector<Volume>& volumes);

}  // namespace ls::scene
