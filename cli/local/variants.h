// Renders the same small image with every variant of the integrator (compiled for a subset of its features)
// that covers a scene: checks that all give the same bits, and measures their cost.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "cli/local/instructions.h"
#include "common/base/digest.h"

namespace ls::cli {

struct VariantBits {
  std::string name;
  Digest sums;
  std::optional<double> instructions;  // per path; nullopt if they cannot be counted
};
// The results for all variants that cover the scene, cheapest first; renders use the first one.
struct VariantBitsList {
  std::vector<VariantBits> all;  // empty: not requested
  std::string uncounted;         // why instructions are missing; empty: none are
};

// Measures the variants called `names`. `render` renders `paths` paths with the variant of the given name and
// returns the digest of their sums. `counter` counts the instructions of this thread, or is the reason why
// they cannot be counted. If counting fails for one variant, only its figure is missing, with the reason.
VariantBitsList measure_variants(const std::vector<std::string>& names, double paths,
                                 const Result<InstructionCounter>& counter,
                                 const std::function<Digest(const std::string&)>& render);

}  // namespace ls::cli
