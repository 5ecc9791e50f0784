// What must hold between the parts of a Scene, beyond the ranges of single fields.
#pragma once

#include <string>

#include "common/scene/scene.h"

namespace ls::scene {

// The first thing wrong: an index out of its list, textures or bsdfs that contain themselves, a bsdf within
// `twosided` that may not be there, a frame too large, matrices that are not finite; empty if all is well.
std::string find_inconsistency(const Scene& scene);

// Pools reduced to what shapes, emitters and the sensor reach, in the order in which they are first reached;
// so scenes that differ only in unused objects or in the order of definitions are equal. `scene` is
// consistent but for order.
Scene compacted(const Scene& scene);

}  // namespace ls::scene
