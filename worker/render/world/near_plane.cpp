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
  if (w.camera.moves()) return true;  // where its near plane passes is not looked at
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

namespace {

// True if the way from one point to another passes a boundary of a medium.
bool passes_boundary(const World& w, const V3& from, const V3& to) {
  constexpr int kMost = 64;  // surfaces that are passed at most
  const V3d way = V3d(to) - V3d(from);
  const double length = way.length();
  if (!(length > 0)) return false;
  const V3 d(way * (1 / length));
  V3 at = from;
  for (int i = 0; i < kMost; ++i) {
    const auto left = static_cast<float>((V3d(to) - V3d(at)).dot(V3d(d)));
    const auto primitive = left > 0 ? w.accel.nearest(at, d, left) : std::nullopt;
    SurfaceHit hit;
    if (!primitive || !w.geometry.complete(*primitive, at, d, hit)) return false;
    if (w.geometry.surfaces[hit.surface].transition) return true;
    at = offset_point(hit, d);
  }
  return false;
}

}  // namespace

Result<void> check_way_of_camera(const World& w) {
  constexpr int kSteps = 256;
  const bool bounded = std::ranges::any_of(w.geometry.surfaces, &SurfaceInfo::transition);
  if (!w.camera.moves() || !bounded) return {};
  // Corners and middle of the frame, by the middle of the lens and by points of its rim.
  struct Track {
    double x, y;
    V2 lens;
  };
  std::vector<Track> tracks{{.5, .5, {.5f, .5f}}};
  if (w.camera.projection() == Projection::orthographic)
    for (const double x : {0., 1.})
      for (const double y : {0., 1.}) tracks.push_back({x, y, {.5f, .5f}});
  if (w.camera.has_lens())
    for (const V2& lens : {V2(0, .5f), V2(.5f, 0), V2(1, .5f), V2(.5f, 1)}) tracks.push_back({.5, .5, lens});
  for (const Track& track : tracks) {
    const auto begin_at = [&](int step) {
      const auto time = static_cast<float>(step) / kSteps;
      return hidden_part(w,
                         w.camera.ray_at(time, track.x * w.frame.width, track.y * w.frame.height, track.lens))
          .start;
    };
    V3 from = begin_at(0);
    for (int step = 1; step <= kSteps; ++step) {
      const V3 to = begin_at(step);
      if (passes_boundary(w, from, to))
        return fail(
            Errc::invalid_argument,
            "the camera moves through the boundary of a medium while the shutter is open, but its rays begin "
            "in one medium: let its animation end before the boundary, or begin behind it");
      from = to;
    }
  }
  return {};
}

}  // namespace ls::render
