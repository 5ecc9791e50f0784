// Asset files (meshes, volume grids, images) that are made from data inside a scene file while that file is
// read.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "formats/read.h"

namespace ls::scene {

// A triangle mesh that becomes a PLY file. All lists except positions and indices may be empty.
struct MadeMesh {
  std::vector<float> positions, normals, uvs;  // per corner (vertex): 3, 3 and 2 numbers
  // The attributes "vertex_color" and "vertex_opacity": per corner 3 numbers and 1 number
  std::vector<float> colours, opacities;
  std::vector<std::uint32_t> indices;  // three corners per triangle, each less than corners()
  std::size_t corners() const { return positions.size() / 3; }
  std::size_t bytes() const;  // upper bound of the PLY file's size in bytes
};

struct MadeGrid {
  std::array<int, 3> sides;
  int channels = 1;
  // The channels of a voxel are adjacent. Of the voxels' coordinates x varies fastest, z slowest.
  std::vector<float> values;
};

// Each function makes a file, gives it to `assets` to keep, and returns the file's name, which contains a
// digest of the file's bytes.
Result<std::string> keep_made(AssetSource& assets, const MadeMesh& mesh);
Result<std::string> keep_made(AssetSource& assets, const MadeGrid& grid);
// Keeps a file with these bytes; its name begins with `kind`, such as "image", and ends in `ending`, such as
// ".png".
Result<std::string> keep_made(AssetSource& assets, std::string_view kind, std::string_view ending,
                              const std::string& bytes);

}  // namespace ls::scene
