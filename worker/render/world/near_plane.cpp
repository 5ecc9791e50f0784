#include "worker/render/world/near_plane.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "worker/render/geometry/surface_boxes.h"

namespace ls::render {
namespace {

// True if some point of the sphere's surface is in the box.
bool touches(const Sphere& s, const SurfaceBox& box) {
  double nearest = 0, farthest = 0;
  for (int k = 0; k < 3; ++k) {
    const double lo = double{box.lo[k]} - s.center[k], hi = double{box.hi[k]} - s.center[k];
    const double out = std::max({lo, -hi, 0.}), far = std::max(std::abs(lo), std::abs(hi));
    nearest += out * out;
    farthest += far * far;
  }
  return nearest <= s.radius * s.radius && farthest >= s.radius * s.radius;
}

// True if a primitive of one of these surfaces, which are not instances, may be in the region.
bool any_touches(const Geometry& g, const std::vector<bool>& surfaces, const SurfaceBox& region) {
  for (std::uint32_t i = g.own.triangles.first; i < g.own.triangles.last; ++i) {
    if (!surfaces[g.triangle_surface[i]]) continue;
    const V3 a = g.vertex(i, 0), b = g.vertex(i, 1), c = g.vertex(i, 2);
    SurfaceBox box;
    for (int k = 0; k < 3; ++k) {
      box.lo[k] = std::min({a[k], b[k], c[k]});
      box.hi[k] = std::max({a[k], b[k], c[k]});
    }
    if (box.touches(region)) return true;
  }
  for (const Sphere& s : g.spheres)
    if (surfaces[s.surface] && touches(s, region)) return true;
  const auto of = [&](const auto& one) { return surfaces[one.surface]; };
  return std::any_of(g.disks.begin(), g.disks.end(), of) ||
         std::any_of(g.cylinders.begin(), g.cylinders.end(), of);
}

}  // namespace

bool near_plane_hides_boundaries(const World& w) {
  const Projection projection = w.camera.projection();
  if (!w.use_media || projection == Projection::spherical || projection == Projection::meters) return false;
  const auto boxes = surface_boxes(w.geometry, [](const SurfaceInfo& s) { return s.transition; });
  if (!boxes) return true;
  if (boxes->empty()) return false;
  const auto [low, high] = w.camera.before_near_plane(w.filter.reach());
  SurfaceBox region;
  region.lo = V3(low), region.hi = V3(high);
  std::vector<bool> near(w.geometry.surfaces.size());
  for (const SurfaceBox& box : *boxes) {
    if (!box.touches(region)) continue;
    if (box.instance != kNone) return true;
    near[box.surface] = true;
  }
  return any_touches(w.geometry, near, region);
}

}  // namespace ls::render
