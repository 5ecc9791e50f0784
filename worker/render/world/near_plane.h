// Boundaries of media between the camera's lens and its near plane. Camera rays begin on the near plane, so
// that such a boundary is not seen; but the medium behind it is.
#pragma once

#include "worker/render/geometry/moment.h"
#include "worker/render/world/world.h"

namespace ls::render {

// True if a boundary of a medium may lie between the lens and the near plane of w.camera. The test compares
// boxes: a result of false is certain; a result of true may be wrong, which costs rendering time but changes
// nothing else.
bool near_plane_hides_boundaries(const World& w);

// Returns an error if the camera passes a boundary of a medium while the shutter is open, since one of the
// two moves: its rays begin in one medium, that of the sensor. Follows the points where rays begin, of the
// frame's middle, of the corners of an orthographic camera's frame and of the lens's rim, in steps.
Result<void> check_way_of_camera(const World& w);

// The part of a camera ray before its origin: from a little before the lens, so that a camera that stands on
// a boundary looks through it, to the near plane.
struct HiddenPart {
  V3 start;
  float length = 0;
};
inline HiddenPart hidden_part(const World& w, const CameraRay& ray) {
  const float hidden = w.camera.near_distance(ray);
  const float length = hidden * (1 + 0x1p-10f) + 0x1p-20f * largest(ray.o);
  return {ray.o - ray.d * length, length};
}

// Calls cross(hit, surface) for each boundary that the hidden part of the ray crosses, from the lens on.
template <class Cross>
void for_hidden_boundaries(const World& w, const CameraRay& ray, Cross cross) {
  constexpr int kMost = 64;  // surfaces that are crossed at most
  HiddenPart part = hidden_part(w, ray);
  const Moment moment(w.geometry, ray.time);
  V3 from = part.start;
  for (int i = 0; i < kMost && part.length > 0; ++i) {
    const auto primitive = w.accel.nearest(from, ray.d, part.length, moment);
    SurfaceHit hit;
    if (!primitive || !w.geometry.complete(*primitive, from, ray.d, moment, hit)) return;
    cross(hit, w.geometry.surfaces[hit.surface]);
    const V3 next = offset_point(hit, ray.d);
    part.length -= dot(next - from, ray.d);
    from = next;
  }
}

}  // namespace ls::render
