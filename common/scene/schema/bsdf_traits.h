// Properties of a bsdf that follow from those it contains.
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

// The bsdfs that it contains directly.
std::array<std::optional<BsdfIndex>, 2> nested_bsdfs(const Bsdf& bsdf);

// `known`: the traits of the scene's bsdfs, at least of those that this one contains.
BsdfTraits traits_of(const Bsdf& bsdf, const std::vector<BsdfTraits>& known);

// Traits of every bsdf. nullopt: one refers to a bsdf that does not exist, or they contain each other in a
// cycle or more than kMaxBsdfNesting deep.
std::optional<std::vector<BsdfTraits>> bsdf_traits(const Scene& scene);

}  // namespace ls::scene
