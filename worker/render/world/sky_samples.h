// Without portals (lights/portals.h) a sky of one radiance is not sampled as a light: directions that BSDFs
// sample find it. Where much of the
// direct light comes from such a sky, its visibility from the first vertex is most of the noise. There a
// second direction is sampled at the first vertex, which only looks for the sky. The two random numbers that
// place it in its lobe are 1 less those of the path's own direction, since a horizon that hides one direction
// often leaves the other free (antithetic variates: Hammersley and Morton 1956). Each of the two directions
// brings half of the sky's light.
#pragma once

#include "common/scene/scene.h"
#include "worker/render/world/world.h"

namespace ls::render {

// Sets `sky_samples` of a world that is otherwise complete, if enough of the direct light that some camera
// paths find comes from a constant environment. It depends only on the scene and the size of the full frame:
// not on the seed, the number of samples or a crop. Not in scenes with media, where a ray to the sky may have
// to track its transmittance, and not where paths are connected to light vertices: light vertices would have
// to be traced just to measure that share.
void learn_sky_samples(const IntegratorSettings& settings, World& w);

}  // namespace ls::render
