// The common parts of all kinds of material: parameters, their lookup at a point, and the interface of a
// kind. A kind is a struct for one type of material, such as Diffuse.
#pragma once

#include <algorithm>
#include <array>
#include <variant>

#include "worker/render/base/kinds.h"
#include "worker/render/bsdf/bsdf.h"
#include "worker/render/bsdf/fresnel.h"
#include "worker/render/bsdf/microfacet.h"

namespace ls::render {

// One parameter of a material, such as a reflectance or a roughness: its value if it is constant, else the
// texture that contains it.
struct Slot {
  C3 value{1, 1, 1};
  TextureIndex texture;
  bool constant = true;
};

template <class... Slots>
bool any_texture(const Slots&... slots) {
  return !(slots.constant && ...);
}

struct Roughness {
  Microfacet distribution = Microfacet::beckmann;
  Slot u, v;

  bool same_along_both() const {
    return u.constant ? v.constant && u.value == v.value : !v.constant && u.texture == v.texture;
  }
  bool always_mirror() const {
    return u.constant && v.constant && u.value.x < kSpecularAlpha && v.value.x < kSpecularAlpha;
  }
};

// Reads the parameters of a material at one point of a surface.
struct Lookup {
  const BsdfTable& table;  // used by materials that consist of other materials
  const TextureTable& textures;
  const UvPoint& at;

  C3 reflectance(const Slot& s) const {
    if (s.constant) return s.value;
    const C3 c = textures.eval(s.texture, at.uv, at.face);
    return {std::clamp(c.x, 0.f, 1.f), std::clamp(c.y, 0.f, 1.f), std::clamp(c.z, 0.f, 1.f)};
  }
  float scalar(const Slot& s) const {
    if (!s.constant) return textures.number(s.texture, at.uv, at.face);
    const C3& c = s.value;
    return c.x == c.y && c.y == c.z ? c.x : luminance(c);
  }
  float share(const Slot& s) const { return std::clamp(scalar(s), 0.f, 1.f); }
  struct RoughnessHere {
    Microfacets facets;
    bool mirror;
  };
  RoughnessHere roughness(const Roughness& r) const {
    const float u = scalar(r.u), v = scalar(r.v);
    return {{r.distribution, std::max(u, kMinAlpha), std::max(v, kMinAlpha)},
            u < kSpecularAlpha && v < kSpecularAlpha};
  }
};

// The interface of a kind of material, with defaults. Each kind derives from this class and hides the members
// that differ from the defaults; every kind must define sample().
struct MaterialKind {
  // True if the back of the surface is black. eval() and sample() are then called only for directions above
  // the surface (z > 0).
  static constexpr bool kFrontOnly = true;
  static constexpr bool kSmooth = false;   // true if the kind has a lobe that is not a delta
  static constexpr bool kDiffuse = false;  // see BsdfTable::is_diffuse

  static bool reads_slopes() { return false; }  // see BsdfTable::reads_slopes
  static bool reads_uv() { return false; }
  static bool anisotropic() { return false; }
  static std::array<BsdfIndex, 0> parts() { return {}; }  // the materials of which this one consists
  static BsdfEval eval(const Lookup&, const V3& /*wo*/, const V3& /*wi*/) { return {}; }
  static NullTransmission null_transmission(const Lookup&, const V3& /*w*/) { return {}; }
};

inline V3 mirrored(const V3& w) { return {-w.x, -w.y, w.z}; }

inline std::optional<BsdfSample> sample_mirror(const C3& weight, const V3& wo) {
  BsdfSample s;
  s.wi = mirrored(wo);
  s.weight = weight;
  s.pdf = 1;
  s.delta = true;
  return s;
}

}  // namespace ls::render
