// Indices of refraction of named materials ("water") and of metals, under the names that Mitsuba uses.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/scene/scene.h"

namespace ls::scene {

std::optional<double> named_ior(std::string_view name);
std::vector<std::string> named_iors();

struct Metal {
  std::string_view name;
  Rgb eta, k;
};
const Metal* named_metal(std::string_view name);
std::vector<std::string> named_metals();

}  // namespace ls::scene
