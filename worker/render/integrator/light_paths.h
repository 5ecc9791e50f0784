// Camera paths that are traced before the first sample teach a world which portals the sky's light comes
// through (lights/portals.h), which lights reach which places (lights/local_lights.h), whether to connect
// paths to light vertices (lights/light_vertices.h), and which part of the sun's light the light vertices
// need. The light vertices are traced here, too.
#pragma once

#include <cstdint>

#include "common/scene/scene.h"
#include "worker/render/world/world.h"

namespace ls::render {

// Sets `sun`, `sun_map`, `faint` and Features::connected of a world that is otherwise complete. The result
// depends only on the scene, the depth limits and the size of the full frame: not on the seed, the number of
// samples, a crop or the number of threads. The integrator must be `volpath` or `path`.
void learn_connections(const IntegratorSettings& settings, int threads, World& w);

// Sets the portals of a world's lights if they pay. The result depends on the same things as that of
// learn_connections(), and the integrator must be one of the same.
void learn_portals(const IntegratorSettings& settings, int threads, World& w);
// Lets lights be chosen by place if that pays or the settings ask for it. The result depends on the same
// things as that of learn_connections(), and the integrator must be one of the same.
void learn_local_lights(const IntegratorSettings& settings, int threads, World& w);

// Traces the light vertices of one set (LightVertexCache). They depend only on the world, its seed and the
// number of the set.
LightVertices trace_light_vertices(const World& w, std::uint64_t set);

// Returns the data by which LightVertices estimates how much a vertex contributes to other points.
LightVertices::Look look_of(const World& w, const LightVertex& y);

}  // namespace ls::render
