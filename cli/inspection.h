// What `lightshaft inspect` has to tell: what a scene uses of the renderer, what is left out and why, and
// what each part costs in bytes. As JSON, and laid out for people.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "cli/local_world.h"

namespace ls::cli {

// Of a small rendering by one of the integrator's instantiations.
struct VariantBits {
  std::string name;
  Digest sums;
};

nlohmann::ordered_json inspection(const LocalScene& scene, const LocalWorld& built,
                                  const std::vector<VariantBits>& variants);

// Of what inspection() gave. Lines end with a newline each.
std::string inspection_text(const nlohmann::ordered_json& inspection);

}  // namespace ls::cli
