// A material in the form that the inner loop uses: one of the kinds of all families.
#pragma once

#include "worker/render/bsdf/coated_conductor.h"
#include "worker/render/bsdf/conductor.h"
#include "worker/render/bsdf/dielectric.h"
#include "worker/render/bsdf/diffuse.h"
#include "worker/render/bsdf/nested.h"
#include "worker/render/bsdf/plastic.h"
#include "worker/render/bsdf/principled.h"

namespace ls::render {

struct BsdfTable::Material {
  VariantOf<DiffuseKinds, ConductorKinds, DielectricKinds, PlasticKinds, NestedKinds, PrincipledKinds,
            CoatedConductorKinds>
      kind;
};

}  // namespace ls::render
