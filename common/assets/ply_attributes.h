// Groups the properties of a PLY element into attributes, by the rules of Mitsuba 3.9.
//
// Properties r g b, or red green blue, at any position are the attribute "color"; a fourth property, a or
// alpha, is ignored. Other properties count only if their name ends in an underscore and one character.
// Consecutive ones with the same prefix form a group: foo_x foo_y foo_z, foo_0 foo_1 foo_2 or foo_1 foo_2
// foo_3 are the attribute "foo", foo_r foo_g foo_b are "foo_color", each of three numbers. A group that
// consists only of its first property is an attribute of one number. Groups of two or four are no attribute.
// If several groups with the same prefix would be attributes, only the first one is.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace ls {

struct PlyAttribute {
  std::string name;                     // without "vertex_" or "face_"
  std::vector<std::size_t> properties;  // indices of its properties: one or three
};

// Returns the attributes of an element. `names` are the names of its properties in order; empty names are
// skipped.
std::vector<PlyAttribute> ply_attributes(std::span<const std::string_view> names);

}  // namespace ls
