// The stretch of a ray through one medium, from where the path stands to the next surface.
#pragma once

#include "worker/render/geometry.h"

namespace ls::render {

struct Segment {
  float length;           // infinite where no surface is met
  float lead;             // the share of it that the ray's start is moved off the surface it left
  const SurfaceHit* end;  // nullptr: none
};

}  // namespace ls::render
