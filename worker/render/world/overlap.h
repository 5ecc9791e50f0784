// Detects nested and intersecting boundaries of media when the world is built, so that scenes without them
// pay nothing during rendering.
#pragma once

#include "worker/render/media/medium_stack.h"
#include "worker/render/world/world.h"

namespace ls::render {

// True if media may overlap: if some point may be in several media, or in a medium other than the one on its
// side of the boundary that was crossed last. The test compares bounding boxes: a result of false is certain;
// a result of true may be wrong, which costs rendering time but changes nothing else.
bool media_may_overlap(const World& w);

// Returns the media that contain the camera, for scenes whose media overlap. If the scene gives the sensor no
// medium, there are none, as in Mitsuba. Otherwise they are the sensor's `medium` and the interiors of the
// closed boundaries around the camera. A boundary counts as enclosing the camera if at least two of three
// rays from the camera leave it without having entered it. The camera's position is the origin of the ray
// through the image's centre; it is the lens instead if World::hidden_boundaries is set.
MediaState camera_media(const World& w);

// Returns the media that contain p: `ambience`, the medium around everything (kNone: none), and the interiors
// of the closed boundaries around p, which are found as for the camera. If `ambience` is also the medium of a
// boundary around p, it counts as the interior of this boundary only.
MediaState media_at(const World& w, const V3& p, std::uint32_t ambience);

// Sets the media in which paths of the world's meters begin. Meters of which not all paths begin in the same
// media get none.
void place_meters(World& w);

}  // namespace ls::render
