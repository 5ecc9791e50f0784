// The path tracers of the integrator `whitted`. They take long to compile, so they have their own source
// file.
#include "worker/render/integrator/variant.h"

namespace ls::render {

std::span<const Variant> whitted_variants() {
  // Features::overlaps is for scenes with coincident surfaces: a ray that hits one of them tests all of them.
  static constexpr Variant kVariants[] = {
      variant<Features{.passing = true, .whitted = true}>("surfaces, whitted"),
      variant<Features{.overlaps = true, .passing = true, .whitted = true}>("coincident surfaces, whitted"),
  };
  return kVariants;
}

const Variant kWhittedSplitVariant =
    variant<Features{.overlaps = true, .passing = true, .split = true, .whitted = true}>(
        "coincident surfaces, whitted, and light in parts");

}  // namespace ls::render
