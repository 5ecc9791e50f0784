// Decides at which additional points (segment_nee.h) and in which additional directions
// (lamp_directions.h) a world's paths sample light.
#pragma once

#include "common/scene/scene.h"

namespace ls::render {

class World;

// Sets `lamps`, `camera_points` and Features::aimed of a world that is otherwise complete, by its scene's
// integrator settings.
void aim(const IntegratorSettings& settings, World& world);

}  // namespace ls::render
