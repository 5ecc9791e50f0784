#include "worker/render/geometry/coincident.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "worker/render/geometry/surface_boxes.h"

namespace ls::render {
namespace {

// The largest number of pairs of surfaces or flat pieces (struct Piece) that are compared. To compare so many
// takes about half a second. If there are more, all surfaces are marked as coincident.
constexpr std::uint64_t kMaxSurfacePairs = std::uint64_t{1} << 27;

struct Piece {  // a triangle, or half of the square about a disk
  V3d a, b, c;
  double reach() const { return std::max(largest(V3(a)), std::max(largest(V3(b)), largest(V3(c)))); }
  Box box() const {
    Box box;
    for (const V3d& p : {a, b, c}) box.add(p);
    return box;
  }
};

// True if no corner of q is farther than `tolerance` from the plane of p. The tolerance is the offset by
// which rays that leave these surfaces are moved.
bool in_plane(const Piece& p, const Piece& q, double tolerance) {
  const V3d n = (p.b - p.a).cross(p.c - p.a).normalized();
  return std::abs(n.dot(q.a - p.a)) <= tolerance && std::abs(n.dot(q.b - p.a)) <= tolerance &&
         std::abs(n.dot(q.c - p.a)) <= tolerance;
}

bool boxes_touch(const Piece& p, const Piece& q, double tolerance) {
  for (int k = 0; k < 3; ++k) {
    if (std::min({p.a[k], p.b[k], p.c[k]}) > std::max({q.a[k], q.b[k], q.c[k]}) + tolerance) return false;
    if (std::min({q.a[k], q.b[k], q.c[k]}) > std::max({p.a[k], p.b[k], p.c[k]}) + tolerance) return false;
  }
  return true;
}

// True if the boxes of p and q touch and one of them lies in the plane of the other. Both planes are tried,
// because the plane of the larger piece is the more accurate of the two.
bool coincide(const Piece& p, const Piece& q) {
  const double tolerance = std::max(p.reach(), q.reach()) * 0x1p-20;
  return boxes_touch(p, q, tolerance) && (in_plane(p, q, tolerance) || in_plane(q, p, tolerance));
}

class Finder {
 public:
  explicit Finder(Geometry& g) : g_(g), shapes_(g.surfaces.size()) {
    for (std::uint32_t i = 0; i < g.triangle_count(); ++i) {
      Parts& p = shapes_[g.triangle_surface[i]];
      if (p.triangles++ == 0) p.first = i;
    }
    for (const Disk& d : g.disks) shapes_[d.surface].disk = &d;
    for (const Sphere& s : g.spheres) shapes_[s.surface].sphere = &s;
    for (const Cylinder& c : g.cylinders) shapes_[c.surface].cylinder = &c;
  }

  Coincidence run() {
    search();
    const bool any = std::any_of(g_.surfaces.begin(), g_.surfaces.end(),
                                 [](const SurfaceInfo& s) { return s.coincident_reach > 0; });
    return {any, marks_};
  }

 private:
  // The primitives of a surface: the `triangles` triangles of a mesh, which have the indices from `first` on,
  // or a disk, a sphere or a cylinder.
  struct Parts {
    std::uint32_t first = 0, triangles = 0;
    const Disk* disk = nullptr;
    const Sphere* sphere = nullptr;
    const Cylinder* cylinder = nullptr;
    std::uint32_t pieces() const { return triangles + (disk ? 2 : 0); }
  };
  Piece piece(const Parts& s, std::uint32_t i) const {
    if (i < s.triangles)
      return {V3d(g_.vertex(s.first + i, 0)), V3d(g_.vertex(s.first + i, 1)), V3d(g_.vertex(s.first + i, 2))};
    const Disk& d = *s.disk;
    const double side = i == s.triangles ? 1 : -1;
    return {d.center - d.u - d.v, d.center + d.u + d.v, d.center + (d.u - d.v) * side};
  }

  // Searches for coincident surfaces and marks them. If there are too many pairs to compare, it marks all
  // surfaces and stops.
  void search() {
    const auto passable = surface_boxes(g_, [](const SurfaceInfo& s) { return s.passable; });
    const auto all = surface_boxes(g_, [](const SurfaceInfo&) { return true; });
    if (!passable || !all) return mark_all();
    for (const SurfaceBox& n : *passable)
      for (const SurfaceBox& o : *all) {
        if (spent_) return;
        compare(n, o);
      }
  }

  void mark(std::uint32_t surface, double reach, bool own = true) {
    ++marks_;
    SurfaceInfo& s = g_.surfaces[surface];
    s.coincident_reach = std::max(s.coincident_reach, static_cast<float>(reach));
    // Hits in instances do not use SurfaceInfo::reach (Geometry::complete_instanced)
    if (!own) return;
    if (!(s.reach > 0)) {
      const Parts& p = shapes_[surface];
      for (std::uint32_t i = 0; i < p.triangles; ++i) s.reach = std::max(s.reach, g_.reach_of(p.first + i));
    }
    s.reach = std::max(s.reach, s.coincident_reach);
  }
  bool spent(std::uint64_t pairs) {
    if (!spent_ && (pairs_ += pairs) > kMaxSurfacePairs) mark_all();
    return spent_;
  }
  void mark_all() {
    spent_ = true;
    for (SurfaceInfo& s : g_.surfaces) s.coincident_reach = 1;
    const PrimitiveSet& own = g_.own;
    for (std::uint32_t i = own.triangles.first; i < own.triangles.last; ++i) mark(g_.triangle_surface[i], 1);
    for (std::uint32_t i = own.spheres.first; i < own.spheres.last; ++i) mark(g_.spheres[i].surface, 1);
    for (std::uint32_t i = own.disks.first; i < own.disks.last; ++i) mark(g_.disks[i].surface, 1);
    for (std::uint32_t i = own.cylinders.first; i < own.cylinders.last; ++i) mark(g_.cylinders[i].surface, 1);
  }

  void compare(const SurfaceBox& n, const SurfaceBox& o) {
    if (spent(1) || !n.touches(o)) return;
    const SurfaceInfo &mine = g_.surfaces[n.surface], &other = g_.surfaces[o.surface];
    // The same rays pass both, and none enters a medium.
    if (!mine.null && !other.null && mine.hidden == other.hidden && !mine.hidden.has(RayKind::some_shadow) &&
        !mine.transition && !other.transition)
      return;
    if (n.surface == o.surface && n.instance == o.instance) return twice_in_itself(n);
    // Each pair of two passable surfaces is found twice, once in each order, but compared only once.
    if (other.passable && o.surface < n.surface) return;
    if (n.instance != kNone || o.instance != kNone) {
      mark(n.surface, 1, n.instance == kNone);
      mark(o.surface, 1, o.instance == kNone);
      return;
    }
    compare_pieces(n.surface, o);
    compare_round(n.surface, o.surface);
  }

  void compare_pieces(std::uint32_t n, const SurfaceBox& o) {
    const Parts &mine = shapes_[n], &other = shapes_[o.surface];
    for (std::uint32_t i = 0; i < mine.pieces(); ++i) {
      const Piece p = piece(mine, i);
      if (spent(1)) return;
      const Box box = p.box();
      if (!SurfaceBox{n, kNone, V3(box.lo), V3(box.hi)}.touches(o)) continue;
      if (spent(other.pieces())) return;
      for (std::uint32_t k = 0; k < other.pieces(); ++k) {
        const Piece q = piece(other, k);
        if (!coincide(p, q)) continue;
        mark(n, std::max(p.reach(), q.reach()));
        mark(o.surface, std::max(p.reach(), q.reach()));
      }
    }
  }

  void compare_round(std::uint32_t n, std::uint32_t o) {
    const auto note = [&](double apart, double reach) {
      if (apart > reach * 0x1p-20) return;
      mark(n, reach);
      mark(o, reach);
    };
    const Parts &mine = shapes_[n], &other = shapes_[o];
    if (mine.sphere && other.sphere) {
      const Sphere &s = *mine.sphere, &t = *other.sphere;
      note((s.center - t.center).length() + std::abs(s.radius - t.radius),
           largest(V3(s.center)) + std::max(s.radius, t.radius));
    }
    if (mine.cylinder && other.cylinder) {
      const Cylinder &s = *mine.cylinder, &t = *other.cylinder;
      const V3d apart = t.p0 - s.p0;
      note((apart - s.axis * apart.dot(s.axis)).length() + std::abs(s.radius - t.radius),
           largest(V3(s.p0)) + std::max(s.length + s.radius, t.length + t.radius));
    }
  }

  // Marks a mesh that contains the same triangle twice, for example a mesh of cells that share walls.
  void twice_in_itself(const SurfaceBox& n) {
    std::vector<std::array<double, 9>> keys;
    const Parts& mine = shapes_[n.surface];
    if (spent(mine.triangles)) return;
    for (std::uint32_t i = 0; i < mine.triangles; ++i) {
      const Piece p = piece(mine, i);
      std::array<std::array<double, 3>, 3> v{
          {{p.a.x, p.a.y, p.a.z}, {p.b.x, p.b.y, p.b.z}, {p.c.x, p.c.y, p.c.z}}};
      std::sort(v.begin(), v.end());
      keys.push_back({v[0][0], v[0][1], v[0][2], v[1][0], v[1][1], v[1][2], v[2][0], v[2][1], v[2][2]});
    }
    std::sort(keys.begin(), keys.end());
    for (auto it = keys.begin(); (it = std::adjacent_find(it, keys.end())) != keys.end(); ++it)
      for (const double x : *it) mark(n.surface, n.instance == kNone ? std::abs(x) : 1, n.instance == kNone);
  }

  Geometry& g_;
  std::vector<Parts> shapes_;
  std::uint64_t pairs_ = 0, marks_ = 0;
  bool spent_ = false;  // the allowed number of pairs is used up: all surfaces are marked as coincident
};

}  // namespace

Coincidence find_coincident(Geometry& g) {
  const bool any =
      std::any_of(g.surfaces.begin(), g.surfaces.end(), [](const SurfaceInfo& s) { return s.passable; });
  return any ? Finder(g).run() : Coincidence{};
}

}  // namespace ls::render
