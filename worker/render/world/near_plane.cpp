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

// True if a primitive of the set is a boundary of a medium.
bool any_boundary(const Geometry& g, const PrimitiveSet& set) {
  const auto any = [&](const PrimitiveRange& range, const auto& surface_of) {
    for (std::uint32_t i = range.first; i < range.last; ++i)
      if (g.surfaces[surface_of(i)].transition) return true;
    return false;
  };
  return any(set.triangles, [&](std::uint32_t i) { return g.triangle_surface[i]; }) ||
         any(set.spheres, [&](std::uint32_t i) { return g.spheres[i].surface; }) ||
         any(set.disks, [&](std::uint32_t i) { return g.disks[i].surface; }) ||
         any(set.cylinders, [&](std::uint32_t i) { return g.cylinders[i].surface; });
}

// True if the way from one point to another passes a boundary of a medium: one of this instance or, for
// kNone, one that stands still.
bool passes_boundary(const World& w, const Moment& moment, const V3& from, const V3& to,
                     std::uint32_t instance) {
  constexpr int kMost = 64;  // surfaces that are passed at most
  const Geometry& g = w.geometry;
  const V3d way = V3d(to) - V3d(from);
  const double length = way.length();
  if (!(length > 0)) return false;
  const V3 d(way * (1 / length));
  V3 at = from;
  for (int i = 0; i < kMost; ++i) {
    const auto left = static_cast<float>((V3d(to) - V3d(at)).dot(V3d(d)));
    const auto primitive = left > 0 ? w.accel.nearest(at, d, left, moment) : std::nullopt;
    SurfaceHit hit;
    if (!primitive || !g.complete(*primitive, at, d, moment, hit)) return false;
    const std::uint32_t met = hit.primitive.instance;
    const bool stands = met == kNone || g.instances[met].moving == kNone;
    if (g.surfaces[hit.surface].transition && (instance == kNone ? stands : met == instance)) return true;
    at = offset_point(hit, d);
  }
  return false;
}

// The camera rays that are followed: through corners and middle of the frame, by the middle of the lens and
// by points of its rim.
struct Track {
  double x, y;
  V2 lens;
};
std::vector<Track> tracks_of(const Camera& camera) {
  std::vector<Track> tracks{{.5, .5, {.5f, .5f}}};
  if (camera.projection() == Projection::orthographic)
    for (const double x : {0., 1.})
      for (const double y : {0., 1.}) tracks.push_back({x, y, {.5f, .5f}});
  if (camera.has_lens())
    for (const V2& lens : {V2(0, .5f), V2(.5f, 0), V2(1, .5f), V2(.5f, 1)}) tracks.push_back({.5, .5, lens});
  return tracks;
}

}  // namespace

Result<void> check_way_of_camera(const World& w) {
  constexpr int kSteps = 256;
  const Geometry& g = w.geometry;
  if (!w.moves || w.meters.any() || std::ranges::none_of(g.surfaces, &SurfaceInfo::transition)) return {};
  std::vector<std::uint32_t> moving;  // instances that hold boundaries
  for (std::uint32_t i = 0; i < g.instances.size(); ++i)
    if (g.instances[i].moving != kNone && any_boundary(g, g.groups[g.instances[i].group]))
      moving.push_back(i);
  if (!w.camera.moves() && moving.empty()) return {};
  for (const Track& track : tracks_of(w.camera)) {
    const auto begin_at = [&](float time) {
      const double x = track.x * w.frame.width, y = track.y * w.frame.height;
      return hidden_part(w, w.camera.ray_at(time, x, y, track.lens)).start;
    };
    for (int step = 1; step <= kSteps; ++step) {
      const float before = static_cast<float>(step - 1) / kSteps, after = static_cast<float>(step) / kSteps;
      const Moment moment(g, before);
      const V3 from = begin_at(before), to = begin_at(after);
      if (w.camera.moves() && passes_boundary(w, moment, from, to, kNone))
        return fail(
            Errc::invalid_argument,
            "the camera moves through the boundary of a medium while the shutter is open, but its rays begin "
            "in one medium: let its animation end before the boundary, or begin behind it");
      for (const std::uint32_t i : moving) {
        // As the instance sees it, the camera goes to this place.
        const V3d own = placed_at(g, i, after).to_local.point(V3d(to));
        if (passes_boundary(w, moment, from, V3(placed_at(g, i, before).to_world.point(own)), i))
          return fail(
              Errc::invalid_argument,
              "the boundary of a medium moves over the camera while the shutter is open, but the camera's "
              "rays begin in one medium: let it pass beside the camera, or stay around it");
      }
    }
  }
  return {};
}

}  // namespace ls::render
