// A segment: the part of a ray from the path's current position, in a medium, to the next surface.
#pragma once

#include "worker/render/geometry/geometry.h"

namespace ls::render {

struct Segment {
  float length;           // infinite if no surface is met
  float lead;             // how much of the length lies between the path's position and the offset ray origin
  const SurfaceHit* end;  // nullptr: none
};

}  // namespace ls::render
