// The same scene elsewhere, in other units or turned: what a metamorphic test compares with.
#pragma once

#include "tests/support/scene_builder.h"

namespace ls::test {

// Turned, then scaled, then shifted. `turn` is a rotation.
struct Move {
  Transform turn;
  double scale = 1;
  Vec3 shift{0, 0, 0};
};

// Every length, place and direction of the scene, and every quantity that has a length in its unit, such that
// the image stays what it is.
Scene moved(Scene scene, const Move& move);

// Every colour with its channels in another order: from[c] is the one that channel c gets. Images and what
// weighs channels (the luminance of masks and blends, black bodies) are not for this.
Scene permuted(Scene scene, std::array<std::size_t, 3> from);
bool can_be_permuted(const Scene& scene);

}  // namespace ls::test
