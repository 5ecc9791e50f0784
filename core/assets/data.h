// The data that decoders of meshes, images and grids return, and limits of the sizes of files and of their
// content. Before a decoder allocates memory, it checks the sizes in a file against these limits and against
// the number of available bytes.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/error.h"

namespace ls {

inline constexpr std::uint64_t kMaxAssetBytes = std::uint64_t{8} << 30;
inline constexpr std::uint64_t kMaxMeshVertices = std::uint64_t{1} << 28;
inline constexpr std::uint64_t kMaxMeshTriangles = std::uint64_t{1} << 28;
inline constexpr std::uint32_t kMaxPolygonCorners = 1 << 16;
inline constexpr std::uint32_t kMaxImageSide = 1 << 15;
inline constexpr std::uint64_t kMaxImagePixels = std::uint64_t{1} << 28;
inline constexpr std::uint32_t kMaxGridSide = 1 << 13;
// The most memory that the values of a grid may take in the renderer
inline constexpr std::uint64_t kMaxGridBytes = std::uint64_t{16} << 30;

// A mesh attribute with one or three numbers per vertex or triangle.
struct MeshAttribute {
  std::string name;  // begins with "vertex_" or "face_"
  std::uint32_t components = 1;
  bool bytes = false;         // true: the values are 0 to 255, as in the file
  std::vector<float> values;  // `components` values per vertex or triangle, adjacent in memory
};

// A triangle mesh. `positions` and (if the file has any) `normals` have three floats per vertex, `uvs` two;
// `indices` has three indices per triangle, all below vertex_count(). The v coordinates are as in the file,
// not flipped.
struct MeshData {
  std::vector<float> positions, normals, uvs;
  std::vector<std::uint32_t> indices;
  bool face_normals = false;  // true if the file requests flat shading
  // Number of triangles without area or with a non-finite vertex; `indices` does not contain them.
  std::uint64_t dropped_triangles = 0;
  // Number of faces whose corners have another number of texture coordinates than two each. If there is one,
  // `uvs` are those of the file's vertices alone.
  std::uint64_t wrong_uv_faces = 0;
  std::vector<MeshAttribute> attributes;     // the requested attributes
  std::vector<std::string> attribute_names;  // names of all attributes in the file

  std::size_t vertex_count() const { return positions.size() / 3; }
  std::size_t triangle_count() const { return indices.size() / 3; }
};

// An image, row by row from the top; the channels of a pixel are adjacent. Exactly one of `u8` (codes 0..255)
// and `f32` is filled. channels: 1 grey, 2 grey + alpha, 3 RGB, 4 RGBA. Colours are as stored: by custom
// those of an OpenEXR image are multiplied by its alpha, and those of other formats are not.
struct ImageData {
  std::uint32_t width = 0, height = 0, channels = 0;
  std::vector<std::uint8_t> u8;
  std::vector<float> f32;
  bool srgb = false;  // true: the values are sRGB-encoded (8- and 16-bit files); false: linear
  // If linear colours are not those of sRGB, the matrix (row by row) that makes them so: see ExrImage.
  std::optional<std::array<float, 9>> to_srgb = std::nullopt;

  bool operator==(const ImageData&) const = default;
};

// A dense grid of nx * ny * nz nodes. In `values`, x varies fastest, then y, then z; the channels of a node
// are adjacent. All values are finite and not negative.
struct GridData {
  std::uint32_t nx = 0, ny = 0, nz = 0, channels = 0;
  std::vector<float> values;
  std::array<float, 3> bbox_min{0, 0, 0}, bbox_max{1, 1, 1};
  std::uint64_t negatives = 0;  // number of values below zero in the file, which were set to 0
};

// Reads a file of at most `limit` bytes, and unpacks it if it is packed by gzip (file_form.h). `name` is the
// file's name as written in the scene, for messages.
Result<std::vector<std::byte>> read_asset(const std::filesystem::path& path, std::string_view name,
                                          std::uint64_t limit = kMaxAssetBytes);

}  // namespace ls
