// What `lightshaft inspect` has to tell: what a scene uses of the renderer, what is left out and why, and
// what that costs in bytes and instructions. As JSON, and laid out for people.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "cli/local_world.h"
#include "cli/variants.h"

namespace ls::cli {

nlohmann::ordered_json inspection(const LocalScene& scene, const LocalWorld& built,
                                  const VariantBitsList& variants);

// Of what inspection() gave. Lines end with a newline each.
std::string inspection_text(const nlohmann::ordered_json& inspection);

}  // namespace ls::cli
