// Coincident surfaces of which one is null: the floor under a box of fog, boxes that share a face. A ray
// cannot tell which of them comes first, and the offset that keeps it clear of one takes it past the other,
// so it has to look for both (medium_crossing.h). They are found once, so that only these surfaces pay.
#pragma once

#include "worker/render/geometry/geometry.h"

namespace ls::render {

struct Coincidence {
  bool any = false;         // there are coincident surfaces
  std::uint64_t marks = 0;  // how often a surface was marked as coincident
};

// Sets SurfaceInfo::coincident_reach. Compares triangles and disks in one plane, spheres, and cylinders.
// Treated as coincident without comparison: instances that touch something, and everything if there are too
// many pairs to compare. That costs rendering time and changes nothing else.
Coincidence find_coincident(Geometry& g);

}  // namespace ls::render
