// How often camera rays collide with media.
#pragma once

#include "worker/render/world/world.h"

namespace ls::render {

// Mean probabilities that media scatter or absorb a camera ray before it hits a surface.
struct CameraCollisions {
  float all = 0;  // over all camera rays
  float met = 0;  // over the rays with a probability above 1e-3; 0 if there are none
};

// Computes the means over a lattice of camera rays of the full frame, of which the image may be a crop. Where
// media overlap, only one of them counts at each place.
CameraCollisions camera_collisions(const World& w);

}  // namespace ls::render
