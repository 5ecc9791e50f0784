// A material as BsdfTable stores it for the inner loop: its kind, precomputed constants, and textures for the
// parameters that vary over the surface.
#pragma once

#include "worker/render/bsdf/bsdf.h"
#include "worker/render/bsdf/microfacet.h"
#include "worker/render/bsdf/microfacet_energy.h"
#include "worker/render/bsdf/rough_plastic_table.h"

namespace ls::render {

enum class MaterialKind : std::uint8_t {
  diffuse,  // with one reflectance everywhere
  textured_diffuse,
  conductor,
  rough_conductor,
  dielectric,
  rough_plastic,
  plastic,
  null,
  two_sided,
  // From here on "wide" kinds: they scatter to both sides, or consist of other materials (scatter_wide.cpp).
  thin_dielectric,
  rough_dielectric,
  mask,
  blend,
  normal_map,
  bump_map,
  principled
};
inline constexpr MaterialKind kFirstWide = MaterialKind::thin_dielectric;

// One parameter of a material, such as a reflectance or a roughness: its value if it is constant, else the
// texture to read it from.
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
  bool null_transmission = false;       // part of the light passes straight through, part does not
  bool flips = false, shadows = false;  // maps: flip_invalid_normals, use_shadowing_function
  // Indices of other entries. For two_sided: the materials of the front and the back, neither of them
  // two-sided itself. For mask, blend, normal_map and bump_map: the materials they are made of. For
  // principled: `front` is the index into the list of Principled.
  std::uint32_t front = 0, back = 0;
  // The parameter specular_reflectance. For mask it holds the opacity, for blend the weight, for normal_map
  // the colours, and for bump_map the heights.
  Slot specular_slot;
  Slot second_slot;  // specular_transmittance; diffuse reflectance of diffuse and plastics
  Slot alpha_u, alpha_v;
  C3 eta{0, 0, 0}, k{1, 1, 1};  // conductors
  float ior = 1;                // index of refraction inside over outside
  float specular_weight = 1;    // plastics: probability of sampling the coat, before Fresnel; bump_map: scale
  RoughPlasticTable coat;       // for smooth plastic only its internal reflectance is set
  const MicrofacetEnergy* energy = nullptr;  // rough kinds with multiple_scattering
  C3 mean_fresnel{1, 1, 1};                  // conductor with multiple_scattering
};

}  // namespace ls::render
