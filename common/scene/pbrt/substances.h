// Measured coefficients of substances, by the names that pbrt-v4 has for them.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "common/scene/scene.h"

namespace ls::scene::pbrt {

struct Substance {
  std::string_view name;
  Rgb absorption, scattering;  // per mm; scattering is the reduced coefficient
};

const Substance* find_substance(std::string_view name);  // nullptr: there is none
std::vector<std::string> substance_names();

}  // namespace ls::scene::pbrt
