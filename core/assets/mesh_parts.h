// Parts of the mesh readers: corners of OBJ files, polygons, attributes of PLY files.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/assets/data.h"

namespace ls {

// A corner of a face: the indices of its position (v), uv (vt) and normal (vn), counted from 0. -1 means
// none.
struct Corner {
  std::int64_t v = -1, vt = -1, vn = -1;
  bool operator==(const Corner&) const = default;
};

// The hash is keyed by a secret, so that a file cannot contain corners that were chosen to collide. The
// resulting mesh does not depend on the secret: vertices are numbered in order of appearance.
struct CornerHash {
  std::uint64_t secret = 0;

  std::size_t operator()(const Corner& c) const {
    std::uint64_t h = (static_cast<std::uint64_t>(c.v) ^ secret) * 0x9e3779b97f4a7c15u;
    h = (h ^ (h >> 29) ^ static_cast<std::uint64_t>(c.vt)) * 0xbf58476d1ce4e5b9u + secret;
    h = (h ^ (h >> 32) ^ static_cast<std::uint64_t>(c.vn)) * 0x94d049bb133111ebu;
    return h ^ (h >> 31);
  }
};

// The secret of all CornerHashes of this process, a random number.
std::uint64_t secret_of_this_process();

inline bool is_drawable(const MeshData& m, std::uint32_t a, std::uint32_t b, std::uint32_t c) {
  double p[3][3];
  const std::uint32_t corner[] = {a, b, c};
  for (int i = 0; i < 3; ++i)
    for (int k = 0; k < 3; ++k) {
      p[i][k] = m.positions[std::size_t{corner[i]} * 3 + k];
      if (!std::isfinite(p[i][k])) return false;
    }
  double area2 = 0;
  // The components of the cross product are computed in double. In float the products of differences could
  // underflow, and a tiny triangle would seem to have no area.
  for (int k = 0; k < 3; ++k) {
    const int u = (k + 1) % 3, v = (k + 2) % 3;
    const double n = (p[1][u] - p[0][u]) * (p[2][v] - p[0][v]) - (p[1][v] - p[0][v]) * (p[2][u] - p[0][u]);
    area2 += n * n;
  }
  return area2 > 0;
}

// Adds a polygon to `m` as a fan of triangles, from the corners (0, i, i + 1). Triangles without area or with
// a non-finite vertex are left out and counted in m.dropped_triangles. The indices in `corners` must be in
// range.
inline void add_polygon(MeshData& m, std::span<const std::uint32_t> corners) {
  for (std::size_t i = 1; i + 1 < corners.size(); ++i) {
    if (is_drawable(m, corners[0], corners[i], corners[i + 1]))
      m.indices.insert(m.indices.end(), {corners[0], corners[i], corners[i + 1]});
    else
      ++m.dropped_triangles;
  }
}

struct PlyAttribute {
  std::string name;                     // name of the attribute, without the prefix "vertex_" or "face_"
  std::vector<std::size_t> properties;  // one or three indices of PLY properties, one per component
};

// Groups the properties of a PLY element into attributes, by the rules of Mitsuba 3.9. `names` are the names
// of the properties in order; empty names are skipped.
//
// Properties r g b, or red green blue, at any position are the attribute "color"; a fourth property, a or
// alpha, is ignored. Other properties count only if their name ends in an underscore and one character.
// Consecutive ones with the same prefix form a group: foo_x foo_y foo_z, foo_0 foo_1 foo_2 or foo_1 foo_2
// foo_3 are the attribute "foo", foo_r foo_g foo_b are "foo_color", each of three numbers. A group that
// consists only of its first property is an attribute of one number. Groups of two or four are no attribute.
// If several groups with the same prefix would be attributes, only the first one is.
std::vector<PlyAttribute> ply_attributes(std::span<const std::string_view> names);

}  // namespace ls
