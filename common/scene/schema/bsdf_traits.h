// Properties of a bsdf that follow from its type and from the bsdfs that it contains.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "common/scene/scene.h"

namespace ls::scene {

struct BsdfTraits {
  int depth = 1;             // nesting depth: 1 contains none
  bool transmits = false;    // some light crosses the surface
  bool passes = false;       // part of the light passes straight through: shadow rays must handle it
  bool two_sided = false;    // is a `twosided`
  bool black_behind = true;  // light that reaches its back is absorbed: neither reflected nor transmitted
  bool operator==(const BsdfTraits&) const = default;
};

// Returns the bsdfs that `bsdf` contains directly.
std::array<std::optional<BsdfIndex>, 2> nested_bsdfs(const Bsdf& bsdf);

// Returns the traits of `bsdf`. `known` has the traits of the scene's bsdfs, at least of those that `bsdf`
// contains.
BsdfTraits traits_of(const Bsdf& bsdf, const std::vector<BsdfTraits>& known);

// Returns the traits of every bsdf. nullopt: a bsdf refers to one that does not exist, or bsdfs contain each
// other in a cycle or more than kMaxBsdfNesting deep.
std::optional<std::vector<BsdfTraits>> bsdf_traits(const Scene& scene);

}  // namespace ls::scene
