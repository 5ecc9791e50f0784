// Checks mesh attributes (values at vertices or faces) from files and stores them for the textures that read
// them.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "common/assets/data.h"
#include "common/base/error.h"
#include "common/scene/schema/mesh_attributes.h"
#include "worker/render/texture/surface_attributes.h"

namespace ls::render {

std::vector<std::string> attribute_names(const Scene& scene, const std::vector<scene::AttributeUse>& uses);

// Checks that `mesh`, read from `file`, has the attributes that the textures in `uses` read, in the expected
// size and range. If not, fails with invalid_argument; the message names the file, the attribute and a
// remedy.
Result<void> check_attributes(const MeshData& mesh, std::string_view file, const Scene& scene,
                              const std::vector<scene::AttributeUse>& uses);

// Returns storage, still empty, for the attributes that the scene's textures name.
SurfaceAttributes attributes_of(const Scene& scene);
// Adds the values of one attribute of the mesh of `surface` to `all`. `base` is the index of the mesh's first
// vertex (for an attribute of faces: first triangle) in the world's lists. `kept` is used for attributes of
// faces: it lists the triangles that were kept when those without area were left out.
void add_channel(SurfaceAttributes& all, const MeshAttribute& attribute, std::uint32_t surface,
                 std::uint32_t base, const std::vector<std::uint32_t>& kept);

}  // namespace ls::render
