// Properties of bsdfs, emitters and media that follow from their parameters and from what they contain. No
// files are read.
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

struct EmitterTraits {
  bool dark = false;             // true if it emits no light
  bool delta = false;            // true if it has no extent, so that no ray can hit it
  std::optional<Vec3> position;  // its position in the world; nullopt: infinitely far
};

EmitterTraits traits_of(const Emitter& emitter, const std::vector<Texture>& textures);

// They are conservative: false is certain, but true may be wrong, since a grid file may contain only zeros.
// `chromatic` may be wrong in both directions.
struct MediumTraits {
  bool extinguishes = false;  // the extinction is above 0 somewhere
  bool scatters = false;
  bool emits = false;
  bool chromatic = false;     // the extinction differs between channels; the density in a file counts as grey
  bool grids = false;         // some coefficients are volumes
  bool density_file = false;  // the extinction comes from a grid file
};

MediumTraits traits_of(const Medium& medium, const std::vector<Volume>& volumes);

}  // namespace ls::scene
