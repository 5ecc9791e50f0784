// Reads the <transform> element.
#pragma once

#include <optional>
#include <string_view>

#include "core/scene/scene.h"
#include "core/scene/transform.h"
#include "formats/xml/document.h"

namespace ls::scene {

// Reads a <transform> and returns the product of its steps, where each step is applied after the steps before
// it. A wrong step is reported and skipped.
Transform read_transform(const Element& e, Report& report);
// Reads the attributes x, y and z, or the attribute value="...", of <translate>, <rotate>, <scale>, <vector>
// or <point>. `missing` is used for each of x, y and z that is not given.
std::optional<Vec3> read_xyz(const Element& e, double missing, Report& report);
// Returns the place of the attribute's value, or the place of the element if it has no such attribute.
Span value_place(const Element& e, std::string_view attribute);

}  // namespace ls::scene
