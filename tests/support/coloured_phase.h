// A phase function for tests that none of Henyey-Greenstein's stands for: each colour has values of its own,
// and the colours are blended with droplets.
#pragma once

#include "tests/support/scene_builder.h"

namespace ls::test {

// Returns the scene with this phase function in all its media.
inline SceneBuilder with_coloured_phase(SceneBuilder b) {
  const auto put = [&](const Phase& p) { return SceneBuilder::push<PhaseTag>(b.scene.phases, p); };
  const PhaseIndex table = put(TabulatedPhase{{}, {1, 2, 4}, {4, 1, 2}, {1, 4, 0}, {}, {}});
  const PhaseIndex droplets = put(DropletsPhase{2});
  const PhaseIndex blend = put(BlendPhase{b.constant({.3, .3, .3}), table, droplets});
  for (Medium& medium : b.scene.media) std::visit([&](auto& m) { m.phase = blend; }, medium);
  return b;
}

}  // namespace ls::test
