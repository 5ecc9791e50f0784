// Interiors that no path of light to the camera gets into. Told from the scene alone, so of meshes little.
#pragma once

#include <vector>

#include "common/scene/scene.h"

namespace ls::scene {

// Of each shape, whether its interior medium may go without a change to the image, if nothing else names that
// medium. `scene` is consistent. Paths begin at the camera, in the sensor's medium, and are in another's once
// they leave a surface to its side, reflected or not. So there are two reasons:
// - The surface is black behind: no path leaves it to that side, whatever comes there.
// - It is a sphere or cube that lets nothing through, with neither the camera, nor anything that shines, nor
// a surface
//   that light passes in it or on it. Only rounding takes a path into one (round an edge of a cube), and
//   there it finds no light.
std::vector<bool> unreachable_interiors(const Scene& scene);

}  // namespace ls::scene
