// One material as the inner loop wants it: a tag, constants computed once, textures where they vary.
#pragma once

#include "worker/render/bsdf/bsdf.h"
#include "worker/render/bsdf/microfacet.h"
#include "worker/render/bsdf/microfacet_energy.h"
#include "worker/render/bsdf/rough_plastic_table.h"

namespace ls::render {

enum class MaterialKind : std::uint8_t {
  diffuse,  // of one reflectance everywhere
  textured_diffuse,
  conductor,
  rough_conductor,
  dielectric,
  rough_plastic,
  plastic,
  null,
  two_sided,
  // From here on "wide": they scatter to both sides, or consist of others (scatter_wide.cpp).
  thin_dielectric,
  rough_dielectric,
  mask,
  blend,
  normal_map,
  bump_map,
  principled
};
inline constexpr MaterialKind kFirstWide = MaterialKind::thin_dielectric;

// A reflectance or roughness: its value if constant, else where to read it.
struct Slot {
  C3 value{1, 1, 1};
  TextureIndex texture;
  bool constant = true;
};

struct BsdfTable::Material {
  MaterialKind kind = MaterialKind::diffuse;
  Microfacet distribution = Microfacet::beckmann;
  bool nonlinear = false;
  bool specular = false;                // rough plastic with a smooth coat
  bool veil = false;                    // some light passes straight on, and some does not
  bool flips = false, shadows = false;  // maps: flip_invalid_normals, use_shadowing_function
  std::uint32_t front = 0,
                back = 0;  // two_sided: materials that are not two-sided themselves; parts of others;
                           // principled: front is its place in the list of those
  Slot specular_slot;      // specular_reflectance; opacity of mask, weight of blend, colours of normal_map,
                           // heights of bump_map
  Slot second_slot;        // specular_transmittance; diffuse reflectance of diffuse and plastics
  Slot alpha_u, alpha_v;
  C3 eta{0, 0, 0}, k{1, 1, 1};  // conductors
  float ior = 1;                // inside over outside
  float specular_weight = 1;    // plastics: how often the coat is sampled, before Fresnel; bump_map: scale
  RoughPlasticTable coat;       // of plastic only its internal reflectance
  const MicrofacetEnergy* energy = nullptr;  // rough kinds, if they have multiple_scattering
  C3 mean_fresnel{1, 1, 1};                  // of a conductor with that
};

}  // namespace ls::render
