// Bounding boxes of shapes, computed from the scene description alone. Meshes have no bounding box here,
// since this code does not read their files.
#pragma once

#include <optional>

#include "core/scene/scene.h"

namespace ls::scene {

struct Box {  // a box parallel to the scene's axes
  Vec3 lo, hi;
  bool operator==(const Box&) const = default;
};
Vec3 corner(const Box& b, int k);  // returns corner number k, from 0 to 7
Box grown(Box b, double by);       // returns the box enlarged by `by` on all sides
bool touch(const Box& a, const Box& b);
double largest_coordinate(const Box& b);

// Returns a box that encloses the shape; it may be larger than necessary. For a shape in a group, the box is
// in the group's space. nullopt: the shape is a mesh, or the box is not finite.
std::optional<Box> box_of(const Shape& shape);

// True if `shape` is a sphere or a cube and the point is inside it. Its to_world must be invertible.
bool holds(const Shape& shape, const Vec3& p);

}  // namespace ls::scene
