// Scene shapes as primitives in scene space, in double: between the scene and Geometry, which recentres and
// rounds them.
#pragma once

#include <limits>
#include <optional>
#include <vector>

#include "common/assets/data.h"
#include "common/scene/mesh_attributes.h"
#include "worker/render/geometry.h"

namespace ls::render {

struct LocalMesh {
  std::vector<V3d> positions;
  std::vector<V3d> normals;
  std::vector<V2> uvs;
  std::vector<std::uint32_t> indices;
  bool face_normals = false;            // the file wants its triangles flat
  std::uint64_t dropped_triangles = 0;  // without area, by the file's reader
  std::vector<MeshAttribute> attributes;
};
struct Placed {
  LocalMesh mesh;
  bool normals_given = false;  // by the file
  std::optional<Sphere> sphere;
  std::optional<Disk> disk;
  std::optional<Cylinder> cylinder;
};

struct Bounds {
  V3d lo{std::numeric_limits<double>::infinity()}, hi{-std::numeric_limits<double>::infinity()};
  void add(const V3d& p) {
    for (int k = 0; k < 3; ++k) {
      lo[k] = std::min(lo[k], p[k]);
      hi[k] = std::max(hi[k], p[k]);
    }
  }
  bool empty() const { return !(lo.x <= hi.x); }
};

// Reads and places one shape by its to_world, with the attributes that are used of it. Fails on files and
// transforms that no surface can be made of, and on attributes that the mesh does not have as they are used.
Result<Placed> place(const Shape& shape, const AssetLoader& files,
                     const std::vector<scene::AttributeUse>& uses = {});
void add_bounds(const Placed& placed, Bounds& bounds);

}  // namespace ls::render
