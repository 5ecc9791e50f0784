// Decides at which additional points (segment_nee.h) and in which additional directions (towards
// lamps: lamp_directions.h; towards the sky) a world's paths sample light.
#pragma once

#include "common/scene/scene.h"

namespace ls::render {

class World;

// Sets `lamps`, `camera_points` and Features::aimed of a world that is otherwise complete, by its scene's
// integrator settings.
void aim(const IntegratorSettings& settings, World& world);

// A second direction towards a constant environment. Without portals (lights/portals.h) a sky of one radiance
// is not sampled as a light: the directions that BSDFs sample find it. If much of the direct light comes from
// such a sky, most of the noise comes from its visibility at the first vertex. So a second direction is
// sampled there, and its ray only tests the visibility of the sky. Its two random numbers within the lobe are
// 1 minus those of the path's own direction, since a horizon that hides one direction often leaves the other
// free (antithetic variates: Hammersley and Morton 1956). Each of the two directions contributes half of the
// sky's light.
//
// Sets `sky_samples` of a world that is otherwise complete, if enough of the direct light of some camera
// paths comes from a constant environment. The result depends only on the scene and the size of the full
// frame: not on the seed, the number of samples or a crop. `sky_samples` stays false in scenes with media,
// where a ray to the sky may have to track its transmittance. It also stays false with connections to light
// vertices, because light vertices would have to be traced just to measure the share of the constant
// environment.
void learn_sky_samples(const IntegratorSettings& settings, World& w);

}  // namespace ls::render
