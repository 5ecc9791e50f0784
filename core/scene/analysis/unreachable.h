// Finds media that no camera path can enter because of the shapes around them. Mesh files are not read, so a
// medium inside a mesh is found only if the scene description alone shows that no path enters it.
#pragma once

#include <vector>

#include "core/scene/scene.h"

namespace ls::scene {

// Returns for each shape whether its interior medium can be removed without changing the image, provided that
// nothing else refers to that medium. `scene` must be consistent. Paths begin at the camera, in the sensor's
// medium. A path enters another medium when it leaves a surface towards the medium's side, by reflection or
// transmission. An interior can be removed for either of two reasons:
// - The back of its surface is black. So no path leaves the surface to that side.
// - The shape is a sphere or cube that no light passes, and inside or on this shape there is no camera, no
// emitter and no surface that light passes. Only rounding can put a path inside (around an edge of a cube),
// and such a path finds no light there.
std::vector<bool> unreachable_interiors(const Scene& scene);

}  // namespace ls::scene
