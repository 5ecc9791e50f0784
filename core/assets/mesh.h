// Decodes Wavefront OBJ, Stanford PLY and Mitsuba's `.serialized`. Polygons become triangle fans from their
// first corner, as in Mitsuba.
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>

#include "core/assets/data.h"

namespace ls {

// Reads the statements v, vt, vn and f of an OBJ file; negative indices count back from the last element.
// Statements for groups, materials, smoothing, points and lines are ignored, as are comments. Each distinct
// triple (v, vt, vn) becomes one vertex. If any face uses normals or uvs, all vertices get them: 0 where a
// corner names none. Faces of one or two corners are left out.
Result<MeshData> decode_obj(std::string_view name, std::span<const std::byte> file);

// Reads a PLY file: ascii, binary_little_endian or binary_big_endian, version 1.0. It must have an element
// `vertex` with x y z, optionally nx ny nz and (u v | s t | texture_u texture_v | texture_s texture_t), and
// an element `face` with the list vertex_indices or vertex_index, or an element `tristrips` with such a list,
// in which -1 ends a strip. The list texcoord of a face has u and v for each of its corners; a vertex that
// has different ones at different corners becomes several vertices. `attributes` are the names of the vertex
// and face attributes (mesh_parts.h) that are wanted; those that the file lacks are left out of the mesh.
// Everything else in the file is skipped. A polygon is cut into triangles, and each of them gets the
// attributes of the polygon.
Result<MeshData> decode_ply(std::string_view name, std::span<const std::byte> file,
                            std::span<const std::string> attributes = {});

// Mitsuba's `.serialized` format, version 3 or 4. is_serialized() recognises it by the first bytes.
// decode_serialized() reads mesh number `index` of the file, counted from 0, and skips vertex colours.
bool is_serialized(std::span<const std::byte> file);
Result<MeshData> decode_serialized(std::string_view name, std::span<const std::byte> file, int index);

// Loads a mesh file. Its first bytes decide the format: "ply" means PLY, 0x041C means `.serialized`, anything
// else means OBJ. `index` is used for `.serialized` only, `attributes` for PLY only.
Result<MeshData> load_mesh(const std::filesystem::path& path, std::string_view name, int index = 0,
                           std::span<const std::string> attributes = {});

}  // namespace ls
