// Decides where a world's paths look for light beside the vertices that they reach by chance.
#pragma once

#include "common/image/frame/frame.h"
#include "common/scene/scene.h"

namespace ls::render {

class World;

// Sets `lamps`, `camera_points` and Features::aimed of a world that is complete otherwise, by its scene's
// integrator settings. `frame` is the size of the whole frame, of which the image may be a crop.
void aim(const IntegratorSettings& settings, FrameSize frame, World& world);

}  // namespace ls::render
