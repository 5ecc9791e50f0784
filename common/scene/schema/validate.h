// Consistency between the parts of a Scene, beyond the ranges of single fields.
#pragma once

#include <string>

#include "common/scene/scene.h"

namespace ls::scene {

// The first inconsistency: an index out of range, textures or bsdfs that contain themselves, a bsdf that is
// not allowed within `twosided`, a frame too large, matrices that are not finite; empty if consistent.
std::string find_inconsistency(const Scene& scene);

// Reduces the lists to what shapes, emitters and the sensor reach, in the order in which it is first reached,
// so that scenes that differ only in unused objects or in the order of definitions become equal. `scene` must
// be consistent except for order.
Scene compacted(const Scene& scene);

}  // namespace ls::scene
