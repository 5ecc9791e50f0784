// Wavefront OBJ, Stanford PLY and Mitsuba's `.serialized`. Polygons become fans of triangles from their first
// corner, as in Mitsuba.
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>

#include "common/assets/data.h"

namespace ls {

// v, vt, vn and f; indices may be negative (counted back from the last). Grouping, material and smoothing
// statements, points, lines and comments mean nothing to us. A corner is one vertex for each distinct (v, vt,
// vn). Normals and uvs are kept if any face uses them (0 where a corner has none).
Result<MeshData> decode_obj(std::string_view name, std::span<const std::byte> file);

// ascii, binary_little_endian and binary_big_endian 1.0; element vertex with x y z, maybe nx ny nz and (u v |
// s t | texture_u texture_v); element face with the list vertex_indices or vertex_index; of the rest those of
// `attributes` that there are (ply_attributes.h), and everything else is skipped over. Attributes of a face
// become those of each of its triangles.
Result<MeshData> decode_ply(std::string_view name, std::span<const std::byte> file);
Result<MeshData> decode_ply_with(std::span<const std::string> attributes, std::string_view name,
                                 std::span<const std::byte> file);

// Mitsuba's `.serialized`, versions 3 and 4: mesh number `index` of the file. Vertex colours are skipped
// over.
bool is_serialized(std::span<const std::byte> file);
Result<MeshData> decode_serialized(std::string_view name, std::span<const std::byte> file, int index);

// By the first bytes: "ply" is PLY, 0x041C a `.serialized`, everything else OBJ. `index` counts only of a
// `.serialized`, `attributes` only of PLY.
Result<MeshData> load_mesh(const std::filesystem::path& path, std::string_view name, int index = 0,
                           std::span<const std::string> attributes = {});

}  // namespace ls
