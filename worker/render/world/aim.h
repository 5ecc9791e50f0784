// Decides at which points and in which directions, besides those that paths sample anyway, a world's paths
// look for light.
#pragma once

#include "common/image/frame/frame.h"
#include "common/scene/scene.h"

namespace ls::render {

class World;

// Sets `lamps`, `camera_points` and Features::aimed of a world that is otherwise complete, by its scene's
// integrator settings. `frame` is the size of the whole frame, of which the image may be a crop.
void aim(const IntegratorSettings& settings, FrameSize frame, World& world);

}  // namespace ls::render
