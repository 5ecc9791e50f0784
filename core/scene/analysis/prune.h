// Removes parts of a scene that cannot affect any pixel, before the scene is stored, sent or loaded. They are
// dead branches of materials, lights without power, media without effect or that no light enters
// (unreachable.h), phase functions of media that do not scatter, and invisible surfaces; it also removes the
// files that only these parts refer to. The expected value of every pixel stays the same. The bits of the
// image stay the same too, unless one of the removed parts took part in sampling: rays hit a removed surface,
// next-event estimation sampled a removed light, or a removed medium (one that no light enters) was the
// reason for equi-angular sampling in the remaining media.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "core/scene/scene.h"

namespace ls::scene {

// Objects of one kind that were removed: what they are, why, and how many.
struct LeftOut {
  std::string what, why;
  std::uint32_t count = 1;
  std::uint64_t bytes = 0;  // size, if the object is a removed file; 0 for all other objects
  bool operator==(const LeftOut&) const = default;
};

struct Pruned {
  Scene scene;                    // the remaining scene, compacted (validate.h)
  std::vector<LeftOut> left_out;  // the removed parts, in a fixed order
};

// Properties of the integrator that pruning depends on. `media` is false for integrators that ignore media
// (`path`, `whitted`). `passing_counts` is true if a path's depth limit also counts the surfaces that light
// passes unchanged; then these surfaces affect the image.
struct PrunedFor {
  bool media = true, passing_counts = false;
};
PrunedFor pruned_for(std::string_view integrator, int max_depth);

// Returns `scene` without the parts that cannot affect a pixel. `scene` must be consistent (validate.h).
// Pruning the result again changes nothing.
Pruned pruned(const Scene& scene, const PrunedFor& whom);

}  // namespace ls::scene
