// Detects nested and intersecting boundaries of media, once, when the world is built, so that scenes without
// them take no longer to render.
#pragma once

#include "worker/render/media/medium_stack.h"
#include "worker/render/world/world.h"

namespace ls::render {

// True if some point may lie in several media, or in a medium other than the one on the side of the last
// boundary crossed. This is decided by bounding boxes, conservatively: false is certain, and a true that is
// not needed only costs time.
bool media_may_overlap(const World& w);

// The media that the camera is in: the sensor's `medium`, plus those of the closed boundaries around the
// camera. A boundary counts as around the camera if at least two of three rays say so. If the scene gives the
// sensor no medium, the camera is in none, as in Mitsuba. The camera's position is the origin of its central
// ray.
MediaState camera_media(const World& w);

}  // namespace ls::render
