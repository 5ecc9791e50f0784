// Properties of a bsdf that follow from its type and from the bsdfs that it contains.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "common/scene/scene.h"

namespace ls::scene {

struct BsdfTraits {
  int depth = 1;           // nesting depth: 1 for a bsdf that contains no other
  bool transmits = false;  // true if some light crosses the surface
  // True if part of the light passes straight through, so that shadow rays must handle it
  bool passes = false;
  bool two_sided = false;  // true for `twosided`
  // True if light that reaches its back is absorbed: neither reflected nor transmitted
  bool black_behind = true;
  bool operator==(const BsdfTraits&) const = default;
};

// Returns the bsdfs that `bsdf` contains directly.
std::array<std::optional<BsdfIndex>, 2> nested_bsdfs(const Bsdf& bsdf);

// Where both roughnesses of a rough thin sheet are at most this, light may pass straight through it. The
// limit of the renderer itself (kSpecularAlpha in worker/render/bsdf/dielectric.h) is this or smaller.
inline constexpr double kStraightAlpha = 1e-3;

// Returns the traits of `bsdf`. `known` contains the traits of other bsdfs of the scene, at least of those
// that `bsdf` contains, and `textures` the scene's textures.
BsdfTraits traits_of(const Bsdf& bsdf, const std::vector<BsdfTraits>& known,
                     const std::vector<Texture>& textures);

// Returns the traits of every bsdf. nullopt: a bsdf refers to one that does not exist, or bsdfs contain each
// other in a cycle or more than kMaxBsdfNesting deep.
std::optional<std::vector<BsdfTraits>> bsdf_traits(const Scene& scene);

}  // namespace ls::scene
