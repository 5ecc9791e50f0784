// Groups the properties of a PLY element into the attributes that Mitsuba 3.9 sees.
//
// r g b, or red green blue, at any position (a fourth, a or alpha, is ignored) are "color". Of the others,
// only properties whose name ends in an underscore and one character: neighbours foo_x foo_y foo_z, foo_0
// foo_1 foo_2 or foo_1 foo_2 foo_3 are "foo", foo_r foo_g foo_b are "foo_color"; the first of such a group
// without the others is a single number. Groups of two or four are no attribute, nor is a later one of the
// same name.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace ls {

struct PlyAttribute {
  std::string name;                     // without "vertex_" or "face_"
  std::vector<std::size_t> properties;  // one or three
};

// `names`: of the element's properties in order; empty ones are skipped.
std::vector<PlyAttribute> ply_attributes(std::span<const std::string_view> names);

}  // namespace ls
