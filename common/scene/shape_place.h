// Where a shape lies, as far as the scene itself says: not of meshes, whose files would have to be read.
#pragma once

#include <optional>

#include "common/scene/scene.h"

namespace ls::scene {

struct Box {  // along the axes of the scene
  Vec3 lo, hi;
  bool operator==(const Box&) const = default;
};
Vec3 corner(const Box& b, int k);  // 0 to 7
Box grown(Box b, double by);       // to all sides
bool touch(const Box& a, const Box& b);
double largest_coordinate(const Box& b);

// One that holds the shape, seldom the smallest. Of a shape in a group where the group's own space has it.
std::optional<Box> box_of(const Shape& shape);

// Whether the point is inside of a sphere or cube, whose to_world has an inverse; of other shapes never.
bool holds(const Shape& shape, const Vec3& p);

}  // namespace ls::scene
