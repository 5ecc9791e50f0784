// Attributes of meshes on their way from the file to the textures that read them.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "common/assets/data.h"
#include "common/base/error.h"
#include "common/scene/mesh_attributes.h"
#include "worker/render/texture/surface_attributes.h"

namespace ls::render {

std::vector<std::string> attribute_names(const Scene& scene, const std::vector<scene::AttributeUse>& uses);

// Whether the mesh in this file has what is read of it, in the size and range that it is read in.
// invalid_argument: with the file's and the attribute's name, and what to do.
Result<void> check_attributes(const MeshData& mesh, std::string_view file, const Scene& scene,
                              const std::vector<scene::AttributeUse>& uses);

// Room for the attributes that the scene's textures name.
SurfaceAttributes attributes_of(const Scene& scene);
// The values of one mesh attribute for this surface; of a face's, `kept` says which triangles are there.
void add_channel(SurfaceAttributes& all, const MeshAttribute& attribute, std::uint32_t surface,
                 std::uint32_t base, const std::vector<std::uint32_t>& kept);

}  // namespace ls::render
