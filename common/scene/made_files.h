// Files that readers make from the numbers in a scene's text.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "common/scene/read.h"

namespace ls::scene {

// Triangles for a PLY file. All lists except positions and indices may be empty.
struct MadeMesh {
  std::vector<float> positions, normals, uvs;  // three, three, two numbers per corner (vertex)
  std::vector<float> colours, opacities;       // the attributes "vertex_color", "vertex_opacity": three, one
  std::vector<std::uint32_t> indices;          // three per triangle, all in range
  std::size_t corners() const { return positions.size() / 3; }
  std::size_t bytes() const;  // size of the file
};

struct MadeGrid {
  std::array<int, 3> sides;
  int channels = 1;
  std::vector<float> values;  // x fastest, channels within a voxel
};

// Each makes a file, gives it to `assets` to keep, and returns its name, which contains a digest of its
// bytes.
Result<std::string> keep_made(AssetSource& assets, const MadeMesh& mesh);
Result<std::string> keep_made(AssetSource& assets, const MadeGrid& grid);
// Keeps a grid under this name.
Result<std::string> keep_made(AssetSource& assets, const MadeGrid& grid, const std::string& name);
// Keeps a file with these bytes; its name begins with `kind` ("image") and ends in `ending` (".png").
Result<std::string> keep_made(AssetSource& assets, std::string_view kind, std::string_view ending,
                              const std::string& bytes);

}  // namespace ls::scene
