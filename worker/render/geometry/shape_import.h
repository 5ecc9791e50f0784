// Reads the scene's shapes as primitives in scene space, in double. Geometry later recentres and rounds them.
// Also checks and stores mesh attributes (values at vertices or faces) for the textures that read them.
#pragma once

#include <optional>
#include <vector>

#include "core/assets/data.h"
#include "core/scene/schema/mesh_attributes.h"
#include "worker/render/geometry/surface_boxes.h"
#include "worker/render/texture/surface_attributes.h"

namespace ls::render {

struct LocalMesh {
  std::vector<V3d> positions;
  std::vector<V3d> normals;
  std::vector<V2> uvs;
  std::vector<std::uint32_t> indices;
  bool face_normals = false;            // true if the mesh file itself requests flat shading
  std::uint64_t dropped_triangles = 0;  // triangles without area, left out when the file was read
  std::uint64_t wrong_uv_faces = 0;     // see MeshData
  std::vector<MeshAttribute> attributes;
};
struct Placed {
  LocalMesh mesh;
  bool normals_given = false;  // true if the mesh has normals from its file
  std::optional<Sphere> sphere;
  std::optional<Disk> disk;
  std::optional<Cylinder> cylinder;
};

// Reads one shape and places it by its to_world, with the attributes that textures use. Fails if the file or
// the transform cannot give a surface, or if the mesh lacks an attribute or has it in another form.
Result<Placed> place(const Shape& shape, const AssetLoader& files,
                     const std::vector<scene::AttributeUse>& uses = {});
Box bounds_of(const Placed& placed);

// Returns storage, still empty, for the attributes that the scene's textures name.
SurfaceAttributes attributes_of(const Scene& scene);
// Adds the values of one attribute of the mesh of `surface` to `all`. `base` is the index of the mesh's first
// vertex (for an attribute of faces: first triangle) in the world's lists. `kept` is used for attributes of
// faces: it lists the triangles that were kept when those without area were left out.
void add_channel(SurfaceAttributes& all, const MeshAttribute& attribute, std::uint32_t surface,
                 std::uint32_t base, const std::vector<std::uint32_t>& kept);

}  // namespace ls::render
