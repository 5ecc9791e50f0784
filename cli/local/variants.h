// Renders the same small image with every integrator variant that covers a scene: checks that they give the
// same bits, and measures their cost.
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
// Results for all covering variants, cheapest first, which is the one used for rendering.
struct VariantBitsList {
  std::vector<VariantBits> all;  // empty: not requested
  std::string uncounted;         // why instructions are missing; empty: none are
};

// `render` renders `paths` paths with the named variant and returns the digest of their sums. `counter`: of
// this thread, or the reason why there is none. If counting fails for one variant, only its figure is
// missing, with the reason.
VariantBitsList measure_variants(const std::vector<std::string>& names, double paths,
                                 const Result<InstructionCounter>& counter,
                                 const std::function<Digest(const std::string&)>& render);

}  // namespace ls::cli
