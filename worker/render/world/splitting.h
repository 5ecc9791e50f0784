// Splitting and Russian roulette of paths in scenes with grids, by the light that a path may add to its
// pixel, as in "Adjoint-driven Russian roulette and splitting in light transport simulation" (Vorba and
// Krivanek 2016), but with one estimate per path instead of a learned field.
//
// Splitting: a path whose first vertex is in a grid continues as two paths of half its weight. Nearly all of
// the noise of such a path arises behind that vertex, and splitting adds work only in pixels that show a
// cloud.
//
// Roulette: the brightness of a pixel is about in proportion to the throughput of its paths at their first
// vertex. So Russian roulette compares the throughput of a path with the throughput at the first vertex, not
// with 1. If it were compared with 1, most paths that come from dark ground into a cloud would end, and the
// few that survive would be far brighter than their pixel. If the light found up to the first vertex is
// brighter than the mean radiance of the image, the pixel is bright, and roulette compares with that light.
#pragma once

#include <algorithm>

#include "common/scene/scene.h"
#include "worker/render/world/world.h"

namespace ls::render {

// Limits of the reference, the throughput with which roulette compares (roulette_reference()). The lower one
// lets paths end that come from nearly black surfaces, which are not worth following. The upper one is needed
// because light found at the first vertex may be a bright spot in a dark pixel.
inline constexpr float kDarkestReference = .05f;
inline constexpr float kBrightestReference = 10;

// The throughput below which Russian roulette may end a path. `throughput` is that behind the first vertex,
// `found` the light that was found up to there (mean of the channels), `mean_radiance` that of the image.
inline float roulette_reference(float throughput, float found, float mean_radiance) {
  const float bright = std::min(found / mean_radiance, kBrightestReference);
  return std::max(kDarkestReference, std::max(std::min(throughput, 1.f), bright));
}

// Sets `mean_radiance` and `paths_split` of a world with grids and without light vertices, which is otherwise
// complete. `mean_radiance` is that of the image.
void learn_splitting(const IntegratorSettings& settings, float mean_radiance, World& w);

}  // namespace ls::render
