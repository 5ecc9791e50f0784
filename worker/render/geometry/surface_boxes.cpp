#include "worker/render/geometry/surface_boxes.h"

namespace ls::render {
namespace {

constexpr std::size_t kMaxBoxes = std::size_t{1} << 23;  // so many boxes take 300 MB

// Returns the box of each wanted surface, in the space of its primitives: the world's or that of its group.
std::vector<Box> own_boxes(const Geometry& g, const std::vector<bool>& wanted) {
  std::vector<Box> boxes(g.surfaces.size());
  for (std::uint32_t i = 0; i < g.triangle_count(); ++i) {
    if (!wanted[g.triangle_surface[i]]) continue;
    for (int k = 0; k < 3; ++k) boxes[g.triangle_surface[i]].add(V3d(g.vertex(i, k)));
  }
  for (const Sphere& s : g.spheres) boxes[s.surface].add(box_of(s));
  for (const Disk& s : g.disks) boxes[s.surface].add(box_of(s));
  for (const Cylinder& s : g.cylinders) boxes[s.surface].add(box_of(s));
  return boxes;
}

// Returns the group that each surface belongs to, or kNone.
std::vector<std::uint32_t> groups_of(const Geometry& g) {
  std::vector<std::uint32_t> group(g.surfaces.size(), kNone);
  for (std::uint32_t i = 0; i < g.groups.size(); ++i) {
    const PrimitiveSet& set = g.groups[i];
    for (std::uint32_t k = set.triangles.first; k < set.triangles.last; ++k) group[g.triangle_surface[k]] = i;
    for (std::uint32_t k = set.spheres.first; k < set.spheres.last; ++k) group[g.spheres[k].surface] = i;
    for (std::uint32_t k = set.disks.first; k < set.disks.last; ++k) group[g.disks[k].surface] = i;
    for (std::uint32_t k = set.cylinders.first; k < set.cylinders.last; ++k)
      group[g.cylinders[k].surface] = i;
  }
  return group;
}

}  // namespace

std::optional<std::vector<SurfaceBox>> surface_boxes(const Geometry& g,
                                                     const std::function<bool(const SurfaceInfo&)>& wanted) {
  std::vector<bool> want;
  for (const SurfaceInfo& s : g.surfaces) want.push_back(wanted(s));
  const std::vector<Box> own = own_boxes(g, want);
  const std::vector<std::uint32_t> group = groups_of(g);
  std::vector<std::vector<std::uint32_t>> instances(g.groups.size());
  for (std::uint32_t k = 0; k < g.instances.size(); ++k) instances[g.instances[k].group].push_back(k);
  std::vector<SurfaceBox> boxes;
  for (std::uint32_t i = 0; i < own.size(); ++i) {
    if (!want[i] || own[i].empty()) continue;
    if (group[i] == kNone) {
      boxes.push_back({i, kNone, V3(own[i].lo), V3(own[i].hi)});
      continue;
    }
    if (boxes.size() + instances[group[i]].size() > kMaxBoxes) return std::nullopt;
    for (const std::uint32_t k : instances[group[i]]) {
      const PlacedInstance& placed = g.instances[k];
      const Box b =
          placed.moving == kNone ? own[i].moved(placed.to_world) : g.moving[placed.moving].box(own[i], 0, 1);
      boxes.push_back({i, k, V3(b.lo), V3(b.hi)});
    }
  }
  return boxes;
}

}  // namespace ls::render
