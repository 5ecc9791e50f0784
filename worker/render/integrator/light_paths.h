// Camera paths are traced before the first sample to learn how the scene is lit: the portals through which
// the sky's light enters (lights/portals.h), which lights reach which places (lights/local_lights.h), whether
// connections to light vertices pay (lights/light_vertices.h), from which part of the sun's light the light
// vertices should be traced (SunMap), and whether sharing paths between pixels pays (path_reuse.h). A
// technique pays if it reduces the noise by more than it costs. The light vertices are traced here, too.
#pragma once

#include <cstdint>

#include "core/scene/scene.h"
#include "worker/render/world/world.h"

namespace ls::render {

// Decides whether the paths of several pixels share their tails, the parts from their second vertices on
// (path_reuse.h). If so, sets World::reuse and Features::reuse of w, which must be complete otherwise.
// Sharing is possible only if the densities of second vertices are known. The settings request or forbid it,
// or leave the decision to a pilot, which measures whether sharing pays (reuse_variants.cpp).
void share_tails(const IntegratorSettings& settings, int threads, World& w);

// Traces the light vertices of one set (LightVertexCache). They depend only on the world, its seed and the
// number of the set.
LightVertices trace_light_vertices(const World& w, std::uint64_t set);

// Returns the data from which LightVertices estimates the contribution of a vertex to other points.
LightVertices::Look look_of(const World& w, const LightVertex& y);

}  // namespace ls::render
