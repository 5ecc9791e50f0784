// Which properties of a PLY element make up the attributes that Mitsuba 3.9 sees there.
//
// r g b, or red green blue, wherever they stand (a fourth, a or alpha, is left out): "color". Of all other
// properties those whose name ends in an underscore and one character: neighbours foo_x foo_y foo_z, foo_0
// foo_1 foo_2 or foo_1 foo_2 foo_3 are "foo", foo_r foo_g foo_b are "foo_color"; the first of a kind alone is
// one number. Two or four of them are none, nor is what comes later under the same name.
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

// `names`: of the element's properties in their order; an empty one is passed over.
std::vector<PlyAttribute> ply_attributes(std::span<const std::string_view> names);

}  // namespace ls
