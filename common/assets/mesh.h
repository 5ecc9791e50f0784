// Decodes Wavefront OBJ, Stanford PLY and Mitsuba's `.serialized`. Polygons become triangle fans from their
// first corner, as in Mitsuba.
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>

#include "common/assets/data.h"

namespace ls {

// v, vt, vn and f; indices may be negative (counted back from the last). Grouping, material and smoothing
// statements, points, lines and comments are ignored. Each distinct (v, vt, vn) becomes one vertex. Normals
// and uvs are kept if any face uses them (0 for corners without).
Result<MeshData> decode_obj(std::string_view name, std::span<const std::byte> file);

// ascii, binary_little_endian and binary_big_endian 1.0; element vertex with x y z, optionally nx ny nz and
// (u v | s t | texture_u texture_v); element face with the list vertex_indices or vertex_index; of other
// properties the requested `attributes` that exist (ply_attributes.h). Everything else is skipped. Attributes
// of a face become those of each of its triangles.
Result<MeshData> decode_ply(std::string_view name, std::span<const std::byte> file);
Result<MeshData> decode_ply_with(std::span<const std::string> attributes, std::string_view name,
                                 std::span<const std::byte> file);

// Mitsuba's `.serialized`, versions 3 and 4: mesh number `index` of the file. Vertex colours are skipped.
bool is_serialized(std::span<const std::byte> file);
Result<MeshData> decode_serialized(std::string_view name, std::span<const std::byte> file, int index);

// Chooses the format by the first bytes: "ply" is PLY, 0x041C `.serialized`, everything else OBJ. `index` is
// used for `.serialized` only, `attributes` for PLY only.
Result<MeshData> load_mesh(const std::filesystem::path& path, std::string_view name, int index = 0,
                           std::span<const std::string> attributes = {});

}  // namespace ls
