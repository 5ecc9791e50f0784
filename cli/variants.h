// The same small image by every instantiation of the integrator that covers a scene: whether they give the
// same bits, and what each costs.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "cli/instructions.h"
#include "common/base/digest.h"

namespace ls::cli {

struct VariantBits {
  std::string name;
  Digest sums;
  std::optional<double> instructions;  // a path; nothing where they cannot be counted
};
// By every one that covers the scene, the cheapest first, which is the one that it is rendered with.
struct VariantBitsList {
  std::vector<VariantBits> all;  // empty: not asked for
  std::string uncounted;         // why instructions are missing; empty: none is
};

// `render` renders `paths` paths with the named one and gives the digest of their sums. `counter`: of this
// thread, or why there is none. One that fails on the way leaves only its own figure out, and says so.
VariantBitsList measure_variants(const std::vector<std::string>& names, double paths,
                                 const Result<InstructionCounter>& counter,
                                 const std::function<Digest(const std::string&)>& render);

}  // namespace ls::cli
