// Convex regions in which no surface lies. A flight through a medium that begins and ends in such a region
// meets no surface, so no ray has to be traced for it.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "worker/render/geometry/geometry.h"
#include "worker/render/geometry/surface_boxes.h"

namespace ls::render {

// The inside of a sphere, or of a closed convex body with at most kMostPlanes faces, shrunk by more than the
// offsets by which rays leave surfaces.
class ClearRegion {
 public:
  static constexpr std::size_t kMostPlanes = 6;

  // The region inside of a surface that is not in a group. Returns nullopt if the surface is neither a sphere
  // nor such a body, or if the box of another surface touches its box. `boxes` are those of all surfaces.
  static std::optional<ClearRegion> inside(const Geometry& g, std::uint32_t surface,
                                           const std::vector<SurfaceBox>& boxes);

  // False for points that are not finite.
  bool contains(const V3& p) const {
    if (planes_ == 0) return dot(p - center_, p - center_) < radius_ * radius_;
    for (std::size_t i = 0; i < planes_; ++i) {
      if (!(dot(normal_[i], p) < distance_[i])) return false;
    }
    return true;
  }

 private:
  ClearRegion() { normal_.fill(V3(0)); }
  bool add_plane(const V3d& n, double distance);

  std::size_t planes_ = 0;  // 0: a sphere
  V3 center_{0, 0, 0};
  float radius_ = 0;
  std::array<V3, kMostPlanes> normal_;  // outward unit normals
  std::array<float, kMostPlanes> distance_{};
};

}  // namespace ls::render
