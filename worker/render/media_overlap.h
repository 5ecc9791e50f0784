// Which of a world's boundaries lie within or across each other: found once, so that scenes without such
// places pay nothing.
#pragma once

#include "worker/render/media_state.h"
#include "worker/render/world.h"

namespace ls::render {

// Whether some place may have several media, or other ones than the side of the last boundary says. From the
// boxes of the boundaries: may be true without need (then nothing changes but the cost), never false where
// there is need.
bool media_may_overlap(const World& w);

// Which media the camera is in: what the sensor's `medium` says, and with it those of the closed boundaries
// that it stands inside of, by the majority of three rays. Where the scene gives none it is none, as in
// Mitsuba. The camera's place is where the ray in the middle of its frame begins.
MediaState camera_media(const World& w);

}  // namespace ls::render
