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
  // Signed distance along the ray from the path's position to the ray's origin, which is offset from the
  // surface (OffsetRay::lead)
  float lead;
  const SurfaceHit* end;  // hit on the surface at the end; null if the ray hits no surface
};

struct OffsetRay {
  V3 start{0, 0, 0}, origin{0, 0, 0}, d{0, 0, 1};

  // Signed distance from `start` to `origin` along the ray; negative if `origin` was moved backwards.
  float lead() const { return dot(origin - start, d); }

  // Returns the length from `start` to the surface that the ray from `origin` hit at `hit`. It is the ray's
  // length plus lead(). If lead() is negative (because `origin`, a vertex in a medium, was moved away from
  // this surface), it is the distance along the ray from `start` to the tangent plane at the hit, but at most
  // the ray's length.
  float length_to(const SurfaceHit& hit) const {
    const float ahead = lead();
    if (ahead < 0) [[unlikely]]
      return std::min(hit.t, std::max(0.f, dot(hit.p - start, hit.ng) / dot(d, hit.ng)));
    return hit.t + ahead;
  }

  // Moves the point p, which is at distance t on the segment s, off the surfaces at both ends of the segment.
  // The result is at least as far from them as the origins of rays that leave them, so that rounding cannot
  // put it on their other side.
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
  // `offset` is the vector by which rays that leave a surface are moved off it, and `from_surface` leads from
  // a point of the surface to p. Returns the part of the offset that has to be added to p so that p is as far
  // from the surface as such rays. It is zero if p is far enough from the surface, and longer than `offset`
  // if p is behind the surface. p may be behind a curved surface, because the segment's length was measured
  // along the line from `origin`, and a grazing line from `start` crosses the surface earlier.
  static V3 missing_offset(const V3& offset, const V3& from_surface) {
    const float share = dot(from_surface, offset) / dot(offset, offset);
    return share < 1 ? offset * (1 - share) : V3(0);
  }
  // Used if lead() < 0, that is, if `origin` was moved away from a surface that the ray approaches, and if
  // the path stops well before this surface. Returns the displacement that puts the point at distance t as
  // far from the plane through `start` perpendicular to the offset as `origin` is.
  V3 remaining_lead(float t) const {
    const V3 offset = origin - start;
    return offset * (1 - t * dot(offset, d) / dot(offset, offset));
  }
};

}  // namespace ls::render
