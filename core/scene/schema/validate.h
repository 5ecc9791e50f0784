// Checks the consistency between the parts of a Scene, beyond the ranges of single fields.
#pragma once

#include <cstddef>
#include <string>

#include "core/scene/scene.h"

namespace ls::scene {

// Returns a description of the first inconsistency: an index out of range, textures or bsdfs that contain
// themselves or nest too deep, a bsdf that is not allowed within `twosided`, a group that is empty, out of
// order or not contiguous or has a shape that emits, a crop beyond the frame, a wrong number of labels, a
// meter without points and shape or with both, or a frame that is too large or not that of the meters. Empty
// if the scene is consistent.
std::string find_inconsistency(const Scene& scene);

// Returns how many numbers the scene's meters measure.
std::size_t meter_count(const Scene& scene);
// Returns the film of a scene whose meters measure `count` numbers, at least 1 (core/image/frame/
// meter_blocks.h). Each sample counts in its own pixel.
FilmSettings film_of_meters(std::size_t count);

// Returns the scene without unused objects: it keeps the objects to which shapes, emitters and the sensor
// refer, directly or through other objects. Its lists are in the order in which the objects are first
// reached. So scenes that differ only in unused objects or in the order of definitions become equal. `scene`
// must be consistent, except that its groups may be out of order.
Scene compacted(const Scene& scene);

}  // namespace ls::scene
