// Light that a medium gives off along a ray: the integral of transmittance times emission, all of it at once
// and not only where a flight happens to collide. So it is exact where nothing is absorbed (a tracker has no
// collisions there), and as good in the dark of an opaque medium.
//
// A homogeneous medium has a closed form. A grid is walked by stretches that are short in voxels, each with
// its own exact optical depth (Grid::pass: no tracker's noise) and one emission sample per channel. A sum of
// terms each of which is right on the average is right on the average.
#pragma once

#include "worker/render/medium.h"

namespace ls::render {

// Along t_max of a homogeneous medium; t_max may be infinite. Infinite where light comes without end.
C3 glow_of_length(const Medium& m, float t_max);

// Along o + t d (d of unit length) up to t_max; an unbiased estimate.
C3 glow_of_grid(const Medium& m, const V3& o, const V3& d, float t_max, RandomStream stream);

}  // namespace ls::render
