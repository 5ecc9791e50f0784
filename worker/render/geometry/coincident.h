// Finds surfaces that coincide in some places if some rays pass one of them and not the other: if at least
// one is null, that is, index-matched, or if they are hidden from different rays. Examples are the floor
// under a box of fog, boxes that share a face, and a shape for the camera in the place of one for shadow rays
// and reflections. Ray intersection finds such surfaces in arbitrary order, and the offset that moves a ray's
// origin off one of them also moves it past the others. So a ray that hits one of them has to test for the
// others too (medium_crossing.h). The surfaces are found once, when the world is built, so that only rays
// that hit them take longer.
#pragma once

#include "worker/render/geometry/geometry.h"

namespace ls::render {

struct Coincidence {
  bool any = false;         // true if there are coincident surfaces
  std::uint64_t marks = 0;  // number of times that a surface was marked as coincident
};

// Sets SurfaceInfo::coincident_reach of the surfaces of g that coincide. It compares triangles and disks in
// the same plane, spheres with spheres, and cylinders with cylinders. If the boxes of two such surfaces
// touch and one of the two is in an instance, both are marked without comparison. If there are too
// many pairs to compare, all surfaces are marked. Marking a surface that does not coincide costs rendering
// time and changes nothing else.
Coincidence find_coincident(Geometry& g);

}  // namespace ls::render
