#include "worker/render/geometry/clear_region.h"

#include <algorithm>
#include <cmath>

namespace ls::render {
namespace {

// A region is smaller than its body, on each side, by this share of the body's largest coordinate. The offset
// of a ray from a surface is only 2^-20 of that coordinate.
constexpr double kMargin = 0x1p-12;
// A corner is in the plane of a face if its distance from the plane is at most this share of the body's
// largest coordinate.
constexpr double kFlat = 0x1p-18;

std::vector<std::uint32_t> triangles_of(const Geometry& g, std::uint32_t surface, std::size_t most) {
  std::vector<std::uint32_t> found;
  for (std::uint32_t i = 0; i < g.triangle_count() && found.size() <= most; ++i)
    if (g.triangle_surface[i] == surface) found.push_back(i);
  return found;
}

// True if each edge belongs to exactly two triangles. `corners` lists the three corners of each triangle in
// turn.
bool is_closed(const std::vector<V3d>& corners) {
  const auto start = [&](std::size_t edge) { return corners[edge]; };
  const auto end = [&](std::size_t edge) { return corners[edge % 3 == 2 ? edge - 2 : edge + 1]; };
  for (std::size_t a = 0; a < corners.size(); ++a) {
    int triangles = 0;
    for (std::size_t b = 0; b < corners.size(); ++b)
      triangles += (start(a) == start(b) && end(a) == end(b)) || (start(a) == end(b) && end(a) == start(b));
    if (triangles != 2) return false;
  }
  return true;
}

}  // namespace

std::optional<ClearRegion> ClearRegion::inside(const Geometry& g, std::uint32_t surface,
                                               const std::vector<SurfaceBox>& boxes, bool media_overlap) {
  const auto is_own = [&](const SurfaceBox& b) { return b.surface == surface; };
  const auto own = std::ranges::find_if(boxes, is_own);
  if (own == boxes.end() || own->instance != kNone || g.surfaces[surface].sheet) return std::nullopt;
  if (std::ranges::any_of(boxes, [&](const SurfaceBox& b) { return !is_own(b) && b.touches(*own); }))
    return std::nullopt;
  const double reach = std::max(largest(own->lo), largest(own->hi));
  ClearRegion region;
  region.margin_ = static_cast<float>(kMargin * reach);
  const SurfaceInfo& info = g.surfaces[surface];
  region.lets_out_ = info.null && info.light == kNone && info.exterior == kNone && !media_overlap;
  for (const SurfaceBox& b : boxes) {
    if (is_own(b)) continue;
    const auto margin =
        static_cast<float>(kMargin * std::max({double{largest(b.lo)}, double{largest(b.hi)}, reach}));
    for (int k = 0; k < 3; ++k) {
      region.others_lo_[k] = std::min(region.others_lo_[k], b.lo[k] - margin);
      region.others_hi_[k] = std::max(region.others_hi_[k], b.hi[k] + margin);
    }
  }
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
  if (!is_closed(corners)) return std::nullopt;
  middle = middle * (1. / static_cast<double>(corners.size()));
  struct Plane {
    V3d n;
    double distance;
    double height(const V3d& p) const { return n.dot(p) - distance; }
  };
  std::vector<Plane> planes;
  const double flat = kFlat * reach;
  for (std::size_t i = 0; i < corners.size(); i += 3) {
    const auto corner = [&](std::size_t k) { return corners[i + k]; };
    const auto is_of = [&](const Plane& p) {
      return std::abs(p.height(corner(0))) <= flat && std::abs(p.height(corner(1))) <= flat &&
             std::abs(p.height(corner(2))) <= flat;
    };
    if (std::ranges::any_of(planes, is_of)) continue;
    V3d n = (corner(1) - corner(0)).cross(corner(2) - corner(0));
    if (!(n.length() > 0)) return std::nullopt;
    n = n.normalized();
    if (n.dot(middle - corner(0)) > 0) n = -n;
    const Plane plane{n, n.dot(corner(0))};
    if (std::ranges::any_of(corners, [&](const V3d& c) { return plane.height(c) > flat; }))
      return std::nullopt;
    planes.push_back(plane);
    if (!region.add_plane(n, plane.distance - kMargin * reach)) return std::nullopt;
  }
  return region.contains(V3(middle)) ? std::optional(region) : std::nullopt;
}

// Adds the plane of a face. Returns false, and adds nothing, if there are kMostPlanes planes already.
bool ClearRegion::add_plane(const V3d& n, double distance) {
  if (planes_ == kMostPlanes) return false;
  normal_[planes_] = V3(n);
  distance_[planes_++] = static_cast<float>(distance);
  return true;
}

}  // namespace ls::render
