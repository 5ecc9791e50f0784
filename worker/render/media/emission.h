// Medium emission along a ray: the integral of transmittance times emission over the whole segment, not only
// where a flight happens to collide. So it works where nothing is absorbed (a tracker has no collisions
// there) as well as deep inside an opaque medium.
//
// In a homogeneous medium it has a closed form. In a grid the ray is divided into intervals that are short
// compared with a voxel. Each interval has its exact optical depth (Grid::pass: no tracking noise) and one
// emission sample per channel; the sum of unbiased terms is unbiased.
#pragma once

#include "worker/render/media/medium.h"

namespace ls::render {

// Returns the attenuated emission over the length t_max of a homogeneous medium. t_max may be infinite; the
// result is infinite if the integral diverges.
C3 emission_of_length(const Medium& m, float t_max);

// Returns an unbiased estimate of the attenuated emission of a grid along o + t d, from t = 0 to t_max. d has
// unit length.
C3 emission_of_grid(const Medium& m, const V3& o, const V3& d, float t_max, RandomStream stream);

}  // namespace ls::render
