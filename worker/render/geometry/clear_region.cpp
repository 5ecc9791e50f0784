#include "worker/render/geometry/clear_region.h"

#include <algorithm>
#include <cmath>

namespace ls::render {
namespace {

// By this share of its largest coordinate a region is shrunk. Rays leave surfaces by 2^-20 of theirs.
constexpr double kMargin = 0x1p-12;
// Corners that are farther from a face's plane than this share of the largest coordinate do not belong to it.
constexpr double kFlat = 0x1p-18;

std::vector<std::uint32_t> triangles_of(const Geometry& g, std::uint32_t surface, std::size_t most) {
  std::vector<std::uint32_t> found;
  for (std::uint32_t i = 0; i < g.triangle_count() && found.size() <= most; ++i)
    if (g.triangle_surface[i] == surface) found.push_back(i);
  return found;
}

}  // namespace

std::optional<ClearRegion> ClearRegion::inside(const Geometry& g, std::uint32_t surface,
                                               const std::vector<SurfaceBox>& boxes) {
  const auto is_own = [&](const SurfaceBox& b) { return b.surface == surface; };
  const auto own = std::ranges::find_if(boxes, is_own);
  if (own == boxes.end() || own->instance != kNone || g.surfaces[surface].sheet) return std::nullopt;
  if (std::ranges::any_of(boxes, [&](const SurfaceBox& b) { return !is_own(b) && b.touches(*own); }))
    return std::nullopt;
  const double reach = std::max(largest(own->lo), largest(own->hi));
  ClearRegion region;
  for (const Sphere& s : g.spheres) {
    if (s.surface != surface) continue;
    region.center_ = V3(s.center);
    region.radius_ = static_cast<float>(s.radius - kMargin * reach);
    return region.radius_ > 0 ? std::optional(region) : std::nullopt;
  }
  constexpr std::size_t kMostTriangles = 2 * kMostPlanes;
  const std::vector<std::uint32_t> triangles = triangles_of(g, surface, kMostTriangles);
  if (triangles.empty() || triangles.size() > kMostTriangles) return std::nullopt;
  std::vector<V3d> corners;
  V3d middle(0);
  for (const std::uint32_t t : triangles)
    for (int k = 0; k < 3; ++k) {
      corners.emplace_back(g.vertex(t, k));
      middle = middle + corners.back();
    }
  middle = middle * (1. / static_cast<double>(corners.size()));
  for (std::size_t i = 0; i < corners.size(); i += 3) {
    V3d n = (corners[i + 1] - corners[i]).cross(corners[i + 2] - corners[i]);
    if (!(n.length() > 0)) return std::nullopt;
    n = n.normalized();
    if (n.dot(middle - corners[i]) > 0) n = -n;
    const double distance = n.dot(corners[i]);
    for (const V3d& c : corners)
      if (n.dot(c) > distance + kFlat * reach) return std::nullopt;  // not convex
    if (!region.add_plane(n, distance - kMargin * reach)) return std::nullopt;
  }
  return region.contains(V3(middle)) ? std::optional(region) : std::nullopt;
}

// Adds a plane unless it is there already. Returns false if there are too many.
bool ClearRegion::add_plane(const V3d& n, double distance) {
  for (std::size_t i = 0; i < planes_; ++i)
    if (dot(normal_[i], V3(n)) > 1 - 1e-6f &&
        std::abs(distance_[i] - distance) <= 1e-6 * (1 + std::abs(distance)))
      return true;
  if (planes_ == kMostPlanes) return false;
  normal_[planes_] = V3(n);
  distance_[planes_++] = static_cast<float>(distance);
  return true;
}

}  // namespace ls::render
