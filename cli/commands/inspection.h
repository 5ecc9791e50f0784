// The output of `lightshaft inspect`: the parts of the renderer that a scene uses, those that it does not use
// and why, and the cost in bytes and instructions. It is written as JSON, and as text for users.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "cli/local/instructions.h"
#include "cli/local/local_world.h"

namespace ls::cli {

nlohmann::ordered_json inspection(const LocalScene& scene, const LocalWorld& built,
                                  const VariantBitsList& variants);

// Formats the result of inspection() as text. Every line ends with a newline.
std::string inspection_text(const nlohmann::ordered_json& inspection);

}  // namespace ls::cli
