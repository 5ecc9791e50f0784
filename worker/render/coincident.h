// Surfaces that lie on each other, of which one lets all light pass: the floor under a box of fog, boxes that
// share a face. A ray cannot tell which of them comes first, and the offset that keeps it clear of one takes
// it past the other; so it has to look for both (path_media.h). Found once: only these surfaces pay.
#pragma once

#include "worker/render/geometry.h"

namespace ls::render {

struct Coincidence {
  bool any = false;         // some do
  std::uint64_t marks = 0;  // how often a surface was found to
};

// Sets SurfaceInfo::together. Compared are triangles and disks in one plane, spheres, and
// cylinders. Instances that touch something count as if they coincided with it, and so does everything where
// there are too many pairs to compare: that costs time when rendering, and changes nothing else.
Coincidence find_coincident(Geometry& g);

}  // namespace ls::render
