// What follows for a bsdf from those it contains.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "common/scene/scene.h"

namespace ls::scene {

struct BsdfTraits {
  int depth = 1;             // of nesting: 1 contains none
  bool transmits = false;    // some light crosses the surface
  bool passes = false;       // some of it straight on, unscattered: shadow rays must see it
  bool two_sided = false;    // is a `twosided`
  bool black_behind = true;  // what meets its back ends there: nothing is reflected, nothing gets through
  bool operator==(const BsdfTraits&) const = default;
};

// Those that it contains directly.
std::array<std::optional<BsdfIndex>, 2> nested_bsdfs(const Bsdf& bsdf);

// `known`: the traits of the scene's bsdfs, as far as this one contains them.
BsdfTraits traits_of(const Bsdf& bsdf, const std::vector<BsdfTraits>& known);

// Of every bsdf. Nothing: one names a bsdf that does not exist, or they contain each other in a circle or
// more than kMaxBsdfNesting deep.
std::optional<std::vector<BsdfTraits>> bsdf_traits(const Scene& scene);

}  // namespace ls::scene
