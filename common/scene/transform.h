// 4 x 4 matrices and the <transform> element.
#pragma once

#include "common/scene/document.h"
#include "common/scene/scene.h"

namespace ls::scene {

double dot(const Vec3& a, const Vec3& b);
Vec3 cross(const Vec3& a, const Vec3& b);

Transform multiply(const Transform& a, const Transform& b);
Vec3 transform_point(const Transform& t, const Vec3& p);  // affine part
Vec3 transform_vector(const Transform& t, const Vec3& v);
double determinant3(const Transform& t);  // of the linear part

// Neither flat nor beyond the range of numbers, and so is the inverse.
bool invertible(const Transform& t);
// Moves, turns and mirrors only, up to 1e-3 as Mitsuba 3 tells it for sensors.
bool is_rigid(const Transform& t);

// The steps of a <transform>, each applied after those before it. What is wrong is reported and left out.
Transform read_transform(const Element& e, Report& report);
// The largest relative difference between singular values of the linear part is within rounding of single
// precision.
bool is_similarity(const Transform& t);
// Of a 4 x 4 matrix its x and y rows and its translation, as Mitsuba 3.
UvTransform uv_part(const Transform& t);

// x, y, z or value="..." of <translate>, <rotate>, <scale>, <vector>, <point>; missing parts are `missing`.
std::optional<Vec3> read_xyz(const Element& e, double missing, Report& report);
// Where the attribute's value stands, or the element if there is none.
Span value_place(const Element& e, std::string_view attribute);

}  // namespace ls::scene
