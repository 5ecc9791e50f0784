// Removes what cannot affect any pixel, before the scene is stored, sent or loaded: dead branches of
// materials, lights without power, media without effect or that no light enters (unreachable.h), phase
// functions of media that do not scatter, invisible surfaces; and the files that only these refer to. The
// image stays the same. Its bits do too, unless something was removed that rays used to hit (invisible
// surfaces), that next-event estimation used to sample, or that caused equi-angular sampling in the remaining
// media (a medium that no light enters).
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

// Properties of the integrator that pruning depends on. `media`: false for `path`, which ignores media;
// `passing_counts`: surfaces that light passes unchanged use up its depth, so they are visible by what is
// missing behind them.
struct PrunedFor {
  bool media = true, passing_counts = false;
};
PrunedFor pruned_for(std::string_view integrator, int max_depth);

// `scene` must be consistent (validate.h). Pruning is idempotent.
Pruned pruned(const Scene& scene, const PrunedFor& whom);

}  // namespace ls::scene
