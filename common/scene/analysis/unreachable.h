// Finds media inside shapes that no camera path can enter. This uses the scene description alone, without
// mesh files, so it is conservative for meshes.
#pragma once

#include <vector>

#include "common/scene/scene.h"

namespace ls::scene {

// Returns for each shape whether its interior medium can be removed without changing the image, provided that
// nothing else refers to that medium. `scene` must be consistent. Paths begin at the camera, in the sensor's
// medium. A path enters another medium when it leaves a surface towards the medium's side, by reflection or
// transmission. An interior can be removed for either of two reasons:
// - The back of the surface is black: no path leaves the surface to that side.
// - The shape is a sphere or cube that no light passes, and inside or on this shape there is no camera, no
// emitter and no surface that light passes. Only rounding can put a path inside (around an edge of a cube),
// and such a path finds no light there.
std::vector<bool> unreachable_interiors(const Scene& scene);

}  // namespace ls::scene
