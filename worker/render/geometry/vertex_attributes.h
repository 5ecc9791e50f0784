// Transfers mesh attributes from files to the textures that read them.
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

// Checks that the mesh in this file has the attributes that are read, in the expected size and range.
// invalid_argument names the file and the attribute, and says what to do.
Result<void> check_attributes(const MeshData& mesh, std::string_view file, const Scene& scene,
                              const std::vector<scene::AttributeUse>& uses);

// Empty storage for the attributes that the scene's textures name.
SurfaceAttributes attributes_of(const Scene& scene);
// Adds the values of one mesh attribute for this surface. For face attributes `kept` lists the triangles that
// were kept.
void add_channel(SurfaceAttributes& all, const MeshAttribute& attribute, std::uint32_t surface,
                 std::uint32_t base, const std::vector<std::uint32_t>& kept);

}  // namespace ls::render
