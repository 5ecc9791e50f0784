// Convex regions without surfaces in them. A flight through a medium that begins and ends in such a region
// meets no surface, so no ray has to be traced for it. A ray that leaves the region need not be traced
// either, provided that the surface around the region lets it pass unchanged and no other surface can be in
// its way (way_out()).
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <vector>

#include "worker/render/geometry/geometry.h"
#include "worker/render/geometry/surface_boxes.h"

namespace ls::render {

// The inside of a body, shrunk by more than the offset of rays that leave surfaces (offset_point). The body
// is a sphere, or a closed convex mesh with at most kMostPlanes faces.
class ClearRegion {
 public:
  static constexpr std::size_t kMostPlanes = 6;

  // Returns the region inside of a surface. Returns nullopt if the surface is in a group, if it bounds no
  // body as described above, or if the box of another surface touches its box. `boxes` holds the boxes of all
  // surfaces. `media_overlap` is true if the scene's media may overlap: then the space outside may be filled
  // by a medium even if the surface names no exterior medium.
  static std::optional<ClearRegion> inside(const Geometry& g, std::uint32_t surface,
                                           const std::vector<SurfaceBox>& boxes, bool media_overlap);

  // True if p is in the region. False if p is not finite.
  bool contains(const V3& p) const {
    if (planes_ == 0) return dot(p - center_, p - center_) < radius_ * radius_;
    for (std::size_t i = 0; i < planes_; ++i) {
      if (!(dot(normal_[i], p) < distance_[i])) return false;
    }
    return true;
  }

  // Requires that the region contains o and that d is a unit vector. Returns the distance t at which the ray
  // o + t d leaves the body if it leaves it into a vacuum and certainly meets no other surface, else nullopt.
  std::optional<float> way_out(const V3& o, const V3& d) const {
    if (!lets_out_ || may_meet_others(o, d)) return std::nullopt;
    const float t = distance_to_body(o, d);
    return t < kInfinity ? std::optional(t) : std::nullopt;  // nullopt if d is not finite
  }

 private:
  ClearRegion() { normal_.fill(V3(0)); }
  bool add_plane(const V3d& n, double distance);

  // True if the ray meets the box around all other surfaces.
  bool may_meet_others(const V3& o, const V3& d) const {
    float from = 0, to = kInfinity;
    for (int k = 0; k < 3; ++k) {
      const bool down = std::signbit(d[k]);
      const float enter = ((down ? others_hi_ : others_lo_)[k] - o[k]) / d[k],
                  leave = ((down ? others_lo_ : others_hi_)[k] - o[k]) / d[k];
      if (enter > from) from = enter;
      if (leave < to) to = leave;
    }
    return !(from > to);
  }
  float distance_to_body(const V3& o, const V3& d) const {
    if (planes_ == 0) {
      const V3 c = o - center_;
      const float along = dot(c, d), body = radius_ + margin_;
      return std::sqrt(std::max(0.f, along * along - dot(c, c) + body * body)) - along;
    }
    float t = kInfinity;
    for (std::size_t i = 0; i < planes_; ++i) {
      const float speed = dot(normal_[i], d);
      if (speed > 0) t = std::min(t, (distance_[i] + margin_ - dot(normal_[i], o)) / speed);
    }
    return t;
  }

  std::size_t planes_ = 0;  // number of faces; 0 if the body is a sphere
  V3 center_{0, 0, 0};
  float radius_ = 0;
  std::array<V3, kMostPlanes> normal_;  // outward unit normals of the faces
  std::array<float, kMostPlanes> distance_{};
  float margin_ = 0;  // the distance from the region's faces to those of the body
  // True if the body's surface is index-matched and emits no light, and a vacuum is outside of it
  bool lets_out_ = false;
  // A box around all other surfaces; lo > hi if there are none
  V3 others_lo_{kInfinity, kInfinity, kInfinity}, others_hi_{-kInfinity, -kInfinity, -kInfinity};
};

}  // namespace ls::render
