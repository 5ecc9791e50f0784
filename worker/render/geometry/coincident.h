// Finds surfaces that coincide somewhere and of which at least one is null, that is, index-matched: the floor
// under a box of fog, or boxes that share a face. A ray cannot tell which of them comes first, and the offset
// that keeps it clear of one takes it past the other. So the ray has to look for both (medium_crossing.h).
// The surfaces are found once, when the world is built, so that only rays that meet them take longer.
#pragma once

#include "worker/render/geometry/geometry.h"

namespace ls::render {

struct Coincidence {
  bool any = false;         // there are coincident surfaces
  std::uint64_t marks = 0;  // how often a surface was marked as coincident
};

// Sets SurfaceInfo::coincident_reach of the surfaces of g that coincide. It compares triangles and disks that
// lie in one plane, spheres with spheres, and cylinders with cylinders. Instances that touch something are
// taken as coincident without comparison, and so is everything if there are too many pairs to compare.
// Surfaces taken as coincident that are not cost rendering time and change nothing else.
Coincidence find_coincident(Geometry& g);

}  // namespace ls::render
