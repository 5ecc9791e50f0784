// Decides whether a world's paths also sample light at additional points (segment_nee.h) and in additional
// directions: towards lamps, that is, lights without extent (lamp_directions.h), and towards the sky.
#pragma once

#include "core/scene/scene.h"

namespace ls::render {

class World;

// Sets `lamps`, `lamp_flights`, `camera_points` and Features::aimed of a world that is otherwise complete, as
// the scene's integrator settings request or, where these leave it open, by whether the techniques pay.
void aim(const IntegratorSettings& settings, World& world);

// Sets `sky_samples` of a world that is otherwise complete: decides whether the first vertex of each path
// samples a second direction towards a constant environment, a sky with one radiance everywhere. Without
// portals (lights/portals.h) such a sky is not sampled as a light: the directions that BSDFs sample find it.
// If much of the direct light comes from it, most of the noise comes from its visibility at the first vertex.
// So a second direction is sampled there, and its ray only tests the visibility of the sky. The two random
// numbers that choose it within the BSDF's lobe are 1 minus those of the path's own direction, since a
// horizon that hides one direction often leaves the other free (antithetic variates: Hammersley and Morton
// 1956). Each of the two directions contributes half of the sky's light.
//
// `sky_samples` becomes true if enough of the direct light of some camera paths comes from a constant
// environment. The result depends only on the scene and the size of the full frame: not on the seed, the
// number of samples or a crop. `sky_samples` stays false in scenes with media, where a ray to the sky may
// have to track its transmittance. It also stays false if paths are connected to light vertices
// (light_vertices.h), because light vertices would have to be traced just to measure the share of the
// constant environment.
void learn_sky_samples(const IntegratorSettings& settings, World& w);

}  // namespace ls::render
