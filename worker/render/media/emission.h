// Medium emission along a ray: the integral of transmittance times emission over the whole segment, instead
// of an estimate at the collisions of free flights. So it also works in media without extinction, in which
// there are no collisions, and deep inside opaque media.
//
// In a homogeneous medium it has a closed form. In a grid the ray is divided into intervals, at most one
// voxel long where the fields vary. The optical depth of an interval is exact (Grid::pass). Each channel's
// emission is estimated from one point of the interval, or two if the interval is optically thick and not
// uniform; without extinction it is integrated exactly. Every term is unbiased, hence the sum is.
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
