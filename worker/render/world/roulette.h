// Splitting and Russian roulette of paths and of shadow rays in scenes with grids, that is, heterogeneous
// media.
//
// Splitting: a path whose first vertex is in a grid continues as two paths of half its weight. Nearly all of
// the noise of such a path arises after that vertex, and splitting adds work only in pixels that show a
// cloud.
//
// Roulette of paths: the brightness of a pixel is about in proportion to the throughput of its paths after
// their first vertex. So Russian roulette compares the throughput of a path with its throughput after the
// first vertex, not with 1. If it compared with 1, most paths that come from dark ground into a cloud would
// end, and the few that survive would be far brighter than their pixel. If the light found up to the first
// vertex is brighter than the mean radiance of the image, the pixel is bright, and roulette compares with the
// ratio of the two. This follows "Adjoint-driven Russian roulette and splitting in light transport
// simulation" (Vorba and Krivanek 2016), but with one estimate per path instead of a learned field.
//
// Roulette of shadow rays (Arvo and Kirk 1990, "Particle transport and image synthesis"): in clouds shadow
// rays through grids cost a large part of the time, because each tracks the medium all the way to the light.
// Many of them could add little light, because the phase function has a small value in that direction or
// because the path has a small throughput. So a shadow ray whose light would be faint even without
// attenuation is traced only with a probability in proportion to that light, but at least kLeastTraced.
#pragma once

#include <algorithm>

#include "core/scene/scene.h"
#include "worker/render/world/world.h"

namespace ls::render {

// Limits of the reference, that is, of the throughput with which roulette compares (roulette_reference()).
// The lower limit is there so that paths from nearly black surfaces may end: they are not worth following.
// The upper limit is needed because light found at the first vertex may be a bright spot in a dark pixel.
inline constexpr float kDarkestReference = .05f;
inline constexpr float kBrightestReference = 10;

// Returns the reference: the throughput below which Russian roulette may end a path. `throughput` is the
// path's throughput after its first vertex, `found` the light that it found up to that vertex (mean of the
// channels), and `mean_radiance` the mean radiance of the image.
inline float roulette_reference(float throughput, float found, float mean_radiance) {
  const float bright = std::min(found / mean_radiance, kBrightestReference);
  return std::max(kDarkestReference, std::max(std::min(throughput, 1.f), bright));
}

// Sets `mean_radiance` and `paths_split` of a world with grids and without light vertices (light_vertices.h),
// which is otherwise complete. The parameter `mean_radiance` is the mean radiance of the image.
void learn_splitting(const IntegratorSettings& settings, float mean_radiance, World& w);

// The smallest probability with which a shadow ray is traced. It limits the noise: in pixels of any
// brightness, roulette adds to the variance at most 1 / kLeastTraced - 1 times the second moment of the light
// that the shadow rays find.
inline constexpr float kLeastTraced = .25f;
// Shadow rays that could add less light than this multiple of the image's mean radiance are subject to
// Russian roulette.
inline constexpr float kFaintShadowRay = 1;

// Returns the probability with which a shadow ray is traced. `light` is the light that the ray would add to
// the sample if nothing attenuated it (mean of the channels); `faint_shadow` is World::faint_shadow.
inline float shadow_ray_probability(float light, float faint_shadow) {
  return light < faint_shadow ? std::max(light / faint_shadow, kLeastTraced) : 1.f;
}

// Sets `faint_shadow`, the limit below which shadow rays are subject to roulette, of a world with grids and
// without light vertices, which is otherwise complete. `mean_radiance` is the mean radiance of the image.
void learn_shadow_roulette(const IntegratorSettings& settings, float mean_radiance, World& w);

}  // namespace ls::render
