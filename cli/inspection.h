// What `lightshaft inspect` has to tell: what a scene uses of the renderer, what is left out and why, and
// what that costs in bytes and instructions. As JSON, and laid out for people.
#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "cli/local_world.h"

namespace ls::cli {

// Of a small rendering by one of the integrator's instantiations.
struct VariantBits {
  std::string name;
  Digest sums;
  std::optional<double> instructions;  // a path; nothing where they cannot be counted
};
// By every one that covers the scene, the cheapest first, which is the one that it is rendered with.
struct VariantBitsList {
  std::vector<VariantBits> all;  // empty: not asked for
  std::string uncounted;         // why there are no instructions
};

nlohmann::ordered_json inspection(const LocalScene& scene, const LocalWorld& built,
                                  const VariantBitsList& variants);

// Of what inspection() gave. Lines end with a newline each.
std::string inspection_text(const nlohmann::ordered_json& inspection);

}  // namespace ls::cli
