// One material as the inner loop wants it: a tag, constants computed once, textures where they vary.
#pragma once

#include "worker/render/bsdf/bsdf.h"
#include "worker/render/bsdf/microfacet.h"
#include "worker/render/bsdf/rough_plastic_table.h"

namespace ls::render {

enum class MaterialKind : std::uint8_t {
  diffuse,
  conductor,
  rough_conductor,
  dielectric,
  rough_plastic,
  null,
  two_sided
};

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
  bool specular = false;              // rough plastic with a smooth coat
  std::uint32_t front = 0, back = 0;  // two_sided: materials that are not two-sided themselves
  Slot specular_slot;                 // specular_reflectance
  Slot second_slot;  // specular_transmittance; diffuse reflectance of diffuse and rough_plastic
  Slot alpha_u, alpha_v;
  C3 eta{0, 0, 0}, k{1, 1, 1};  // conductors
  float ior = 1;                // inside over outside
  float specular_weight = 1;    // rough_plastic: how often the coat is sampled, before Fresnel
  RoughPlasticTable coat;
};

}  // namespace ls::render
