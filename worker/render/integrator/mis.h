// MIS weights for two strategies that sample the same light, computed from their densities (Veach 1997,
// section 9.2). Any weights that add up to 1 give unbiased results, so a wrong weight shows only in the
// variance, not in the mean. Therefore the tests check the weights and second moments
// (tests/unit/render/integrator/mis_test.cpp).
#pragma once

#include "core/scene/scene_shapes.h"

namespace ls::render {

// The weight, by the balance heuristic, of the strategy with density `own` against one with density `other`.
inline float balance_weight(float own, float other) { return own / (own + other); }

inline float mis_weight(MisHeuristic heuristic, float own, float other) {
  const float ratio = other / own;
  return 1 / (1 + (heuristic == MisHeuristic::power ? ratio * ratio : ratio));
}

}  // namespace ls::render
