// A segment: the part of a ray from the path's current position, in a medium, to the next surface.
#pragma once

#include "worker/render/geometry/geometry.h"

namespace ls::render {

struct Segment {
  float length;  // infinite if the ray hits no surface
  // The part of the length between the path's position and the offset origin of the ray
  float lead;
  const SurfaceHit* end;  // hit on the surface at the end; nullptr: there is none
};

}  // namespace ls::render
