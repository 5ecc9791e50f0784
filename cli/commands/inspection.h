// The output of `lightshaft inspect`: what a scene uses of the renderer, what is left out and why, and the
// cost in bytes and instructions. As JSON, and formatted for people.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "cli/local/local_world.h"
#include "cli/local/variants.h"

namespace ls::cli {

nlohmann::ordered_json inspection(const LocalScene& scene, const LocalWorld& built,
                                  const VariantBitsList& variants);

// Formats the result of inspection() for people. Every line ends with a newline.
std::string inspection_text(const nlohmann::ordered_json& inspection);

}  // namespace ls::cli
