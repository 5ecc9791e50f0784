// Detects nested and intersecting boundaries of media when the world is built. So scenes without them pay
// nothing during rendering.
#pragma once

#include "worker/render/media/medium_stack.h"
#include "worker/render/world/world.h"

namespace ls::render {

// True if some point may be in several media, or in another medium than the one on its side of the boundary
// crossed last. The test compares bounding boxes: false is certain; an unnecessary true only costs time.
bool media_may_overlap(const World& w);

// Returns the media that contain the camera. If the scene gives the sensor no medium, there are none, as in
// Mitsuba. Otherwise they are the sensor's `medium` and the interiors of the closed boundaries around the
// camera. A boundary counts as enclosing the camera if at least two of three rays leave it without having
// entered it. The camera's position is the origin of its central ray.
MediaState camera_media(const World& w);

}  // namespace ls::render
