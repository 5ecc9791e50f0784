// Properties of bsdfs, emitters and media that follow from their parameters and from what they contain. No
// files are read.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "core/scene/scene.h"

namespace ls::scene {

struct BsdfTraits {
  int depth = 1;           // nesting depth: 1 for a bsdf that contains no other
  bool transmits = false;  // true if some light crosses the surface
  // True if part of the light passes straight through the surface, so that shadow rays are not simply
  // blocked.
  bool passes = false;
  bool two_sided = false;  // true for a TwoSidedBsdf
  // True if the back of the surface absorbs all light: it neither reflects nor transmits.
  bool black_behind = true;
  bool operator==(const BsdfTraits&) const = default;
};

// Returns the bsdfs that `bsdf` contains directly.
std::array<std::optional<BsdfIndex>, 2> nested_bsdfs(const Bsdf& bsdf);

// Where both roughnesses (along u and v) of a rough thin sheet are at most this value, the traits assume that
// light may pass straight through the sheet. The renderer's own limit, kSpecularAlpha in
// worker/render/bsdf/microfacet.h, is equal or smaller.
inline constexpr double kStraightAlpha = 1e-3;

// Returns the traits of `bsdf`. `known` contains the traits of the scene's bsdfs by index; only those of the
// bsdfs that `bsdf` contains are used. `textures` are the scene's textures.
BsdfTraits traits_of(const Bsdf& bsdf, const std::vector<BsdfTraits>& known,
                     const std::vector<Texture>& textures);

// Returns the traits of every bsdf of the scene, by index. nullopt: a bsdf contains an index without a bsdf,
// or bsdfs contain each other in a cycle or more than kMaxBsdfNesting deep.
std::optional<std::vector<BsdfTraits>> bsdf_traits(const Scene& scene);

struct EmitterTraits {
  bool dark = false;             // true if the emitter surely emits no light
  bool delta = false;            // true if it is a single point or a single direction, which no ray can hit
  std::optional<Vec3> position;  // its position in world space; nullopt: it is infinitely far away
};

EmitterTraits traits_of(const Emitter& emitter, const std::vector<Texture>& textures);

// Traits of a medium, found without reading its grid files. A trait that is false is certain. One that is
// true may be wrong, since a grid file may contain only zeros. `chromatic` may be wrong in both cases.
struct MediumTraits {
  bool extinguishes = false;  // true if the extinction is above 0 somewhere
  bool scatters = false;
  bool emits = false;
  bool chromatic = false;  // true if red, green, blue extinctions differ; a grid file is taken to be grey
  // True for a HeterogeneousMedium, whose coefficients are volumes, unless its density falls with height
  // alone
  bool grids = false;
  bool height = false;        // true if its density is a HeightFogVolume
  bool density_file = false;  // true if the extinction comes from a grid file
};

MediumTraits traits_of(const Medium& medium, const std::vector<Volume>& volumes);

}  // namespace ls::scene
