// Removes from a scene what cannot affect any pixel, before the scene is stored, sent or loaded: dead
// branches of materials, lights without power, media without effect or that no light enters (unreachable.h),
// phase functions of media that do not scatter, invisible surfaces; and the files that only these refer to.
// The image stays the same. Its bits stay the same too, with three exceptions: rays used to hit a removed
// surface (invisible surfaces), next-event estimation used to sample a removed light, or a removed medium
// (one that no light enters) caused equi-angular sampling in the remaining media.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "common/scene/scene.h"

namespace ls::scene {

// A kind of removed objects, their number, and the reason.
struct LeftOut {
  std::string what, why;
  std::uint32_t count = 1;
  std::uint64_t bytes = 0;  // of files; 0 for anything else
  bool operator==(const LeftOut&) const = default;
};

struct Pruned {
  Scene scene;                    // compacted
  std::vector<LeftOut> left_out;  // in a fixed order
};

// Properties of the integrator that pruning depends on. `media` is false for `path`, which ignores media.
// `passing_counts` is true if surfaces that light passes unchanged use up the path's depth; then they are
// visible by what is missing behind them.
struct PrunedFor {
  bool media = true, passing_counts = false;
};
PrunedFor pruned_for(std::string_view integrator, int max_depth);

// Returns `scene` without what cannot affect a pixel. `scene` must be consistent (validate.h). Pruning the
// result again changes nothing.
Pruned pruned(const Scene& scene, const PrunedFor& whom);

}  // namespace ls::scene
