// Camera paths are traced before the first sample to learn how the scene is lit: the portals through which
// the sky's light enters (lights/portals.h), which lights reach which places (lights/local_lights.h), whether
// connections to light vertices pay (lights/light_vertices.h), and from which part of the sun's light the
// light vertices should be traced (SunMap). A technique pays if it reduces the noise by more than it costs.
// The light vertices are traced here, too.
#pragma once

#include <cstdint>

#include "common/scene/scene.h"
#include "worker/render/world/world.h"

namespace ls::render {

// If connections to light vertices pay or the settings request them, sets `sun`, `sun_map`, `faint`,
// `connections_per_ray` and Features::connected of a world that is otherwise complete, lowers its `rr_depth`,
// and calls aim() again. The result depends only on the scene, the depth limits and the size of the full
// frame: not on the seed, the number of samples, a crop or the number of threads. The integrator must be
// `volpath` or `path`.
void learn_connections(const IntegratorSettings& settings, int threads, World& w);

// Sets the portals of a world's lights if they pay or the settings request them. Depends on the same data,
// and requires the same integrators, as learn_connections().
void learn_portals(const IntegratorSettings& settings, int threads, World& w);
// Enables the choice of lights by place if it pays or the settings request it. Depends on the same data, and
// requires the same integrators, as learn_connections().
void learn_local_lights(const IntegratorSettings& settings, int threads, World& w);

// Traces the light vertices of one set (LightVertexCache). They depend only on the world, its seed and the
// number of the set.
LightVertices trace_light_vertices(const World& w, std::uint64_t set);

// Returns the data from which LightVertices estimates the contribution of a vertex to other points.
LightVertices::Look look_of(const World& w, const LightVertex& y);

}  // namespace ls::render
