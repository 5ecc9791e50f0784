// Reads the scene's shapes as primitives in scene space, in double. Geometry later recentres and rounds them.
#pragma once

#include <limits>
#include <optional>
#include <vector>

#include "common/assets/data.h"
#include "common/scene/schema/mesh_attributes.h"
#include "worker/render/geometry/geometry.h"

namespace ls::render {

struct LocalMesh {
  std::vector<V3d> positions;
  std::vector<V3d> normals;
  std::vector<V2> uvs;
  std::vector<std::uint32_t> indices;
  bool face_normals = false;            // true if the file requests flat triangles
  std::uint64_t dropped_triangles = 0;  // number of triangles without area, which the file's reader left out
  std::vector<MeshAttribute> attributes;
};
struct Placed {
  LocalMesh mesh;
  bool normals_given = false;  // true if the file has normals
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

// Reads one shape and places it by its to_world, with the attributes that textures use. Fails if the file or
// the transform cannot give a surface, or if the mesh lacks an attribute or has it in another form.
Result<Placed> place(const Shape& shape, const AssetLoader& files,
                     const std::vector<scene::AttributeUse>& uses = {});
void add_bounds(const Placed& placed, Bounds& bounds);

}  // namespace ls::render
