// What of a scene can't matter to any pixel, taken out before the scene is stored, sent or loaded: dead
// branches of materials, lights without power, media that do nothing or that no light gets into
// (unreachable.h), phase functions of media that scatter nothing, surfaces that nobody can see; and with them
// the files that only they named. What is left gives the same image. Its bits are the same too, unless
// something went that rays used to stop at (invisible surfaces), that next-event estimation used to choose,
// or for whose sake points were sampled about lights in media that stay, too (a medium that no light gets
// into).
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "common/scene/scene.h"

namespace ls::scene {

// So many of these, and why they are not needed.
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

// For which integrator: `media` is false for `path`, whose scenes have none; `passing_counts` where surfaces
// that light passes unchanged use up its depth, so that they can be told by what is missing behind them.
struct PrunedFor {
  bool media = true, passing_counts = false;
};
PrunedFor pruned_for(std::string_view integrator, int max_depth);

// `scene` is consistent (validate.h). Pruning what is pruned changes nothing.
Pruned pruned(const Scene& scene, const PrunedFor& whom);

}  // namespace ls::scene
