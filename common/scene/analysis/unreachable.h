// Finds media inside shapes that no camera path can enter. The decision uses the scene description alone,
// without mesh files, so it is conservative for meshes.
#pragma once

#include <vector>

#include "common/scene/scene.h"

namespace ls::scene {

// Returns for each shape whether its interior medium can be removed without changing the image, provided
// that nothing else refers to that medium. `scene` must be consistent. Paths begin at the camera, in the
// sensor's medium, and enter another medium when they leave a surface to its side, reflected or not. There
// are two reasons:
// - The surface is black behind: no path leaves it to that side, whatever arrives there.
// - It is a sphere or cube that lets nothing through, with neither the camera, nor an emitter, nor a surface
//   that light passes inside or on it. Only rounding can put a path inside (around an edge of a cube), and
//   there it finds no light.
std::vector<bool> unreachable_interiors(const Scene& scene);

}  // namespace ls::scene
