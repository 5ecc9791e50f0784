// A ray whose origin is moved off the surface that it leaves, so that it does not hit this surface again.
//
// `start` is the point on the path; `origin` is where the ray is traced from. If the surface bounds a medium,
// the offset between the two lies in the medium, and in a very dense medium it may exceed a mean free path.
// So distances in media are measured from `start`.
#pragma once

#include <algorithm>

#include "worker/render/geometry/geometry.h"

namespace ls::render {

// The part of a ray from the path's current position, in a medium, to the next surface.
struct Segment {
  float length;  // infinite if the ray hits no surface
  // The part of the length between the path's position and the offset origin of the ray
  float lead;
  const SurfaceHit* end;  // hit on the surface at the end; nullptr: there is none
};

struct OffsetRay {
  V3 start{0, 0, 0}, origin{0, 0, 0}, d{0, 0, 1};

  // Signed distance from `start` to `origin` along the ray; negative if `origin` was moved backwards.
  float lead() const { return dot(origin - start, d); }

  // The length from `start` to the surface that the ray from `origin` hit. If `origin` is farther from that
  // surface than `start` (because a vertex in a medium was moved away from this surface), the length is
  // measured to the surface's plane.
  float length_to(const SurfaceHit& hit) const {
    const float ahead = lead();
    if (ahead < 0) [[unlikely]]
      return std::min(hit.t, std::max(0.f, dot(hit.p - start, hit.ng) / dot(d, hit.ng)));
    return hit.t + ahead;
  }

  // The point p, which is at distance t on the segment s, moved off the surfaces at both ends of the segment.
  // It is kept as far from them as the origin of a ray that leaves them, so that rounding cannot put it on
  // their other side.
  V3 moved_off_ends(V3 p, Segment s, float t) const {
    const V3 from_end = s.end ? missing_offset(offset_point(*s.end, -d) - s.end->p, p - s.end->p) : V3(0);
    if (s.lead > 0) p += missing_offset(origin - start, d * t);
    p += from_end;
    if (s.lead < 0 && !(dot(from_end, from_end) > 0)) [[unlikely]]
      p += remaining_lead(t);
    return p;
  }

  // Moves the ray's start to the vertex at distance t on the segment s; the direction stays the same.
  void advance_to(Segment s, float t) {
    const V3 p = start + d * t;
    origin = moved_off_ends(p, s, t);
    start = p;
  }
  // Makes this the ray that leaves the surface at `hit` in the direction w.
  void leave(const SurfaceHit& hit, const V3& w) {
    start = hit.p;
    origin = offset_point(hit, w);
    d = w;
  }

 private:
  // Returns the part of a surface's offset (the vector by which rays that leave it are moved) that a point
  // still needs if it is displaced by `from_surface` from the surface. Zero if the point is far enough from
  // the surface; more than the whole offset if it is behind the surface. A point may be behind a curved
  // surface, because the length was measured along the line from `origin`, and a grazing line from `start`
  // crosses the surface earlier.
  static V3 missing_offset(const V3& offset, const V3& from_surface) {
    const float share = dot(from_surface, offset) / dot(offset, offset);
    return share < 1 ? offset * (1 - share) : V3(0);
  }
  // For a ray that points back at the surface from which its origin was moved away, but ends before it (lead
  // < 0): returns the displacement that puts the point at distance t as far from the surface's plane as
  // `origin` is.
  V3 remaining_lead(float t) const {
    const V3 offset = origin - start;
    return offset * (1 - t * dot(offset, d) / dot(offset, offset));
  }
};

}  // namespace ls::render
