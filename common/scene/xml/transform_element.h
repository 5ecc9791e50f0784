// 4 x 4 matrices and the <transform> element.
#pragma once

#include "common/scene/scene.h"
#include "common/scene/xml/document.h"

namespace ls::scene {

double dot(const Vec3& a, const Vec3& b);
Vec3 cross(const Vec3& a, const Vec3& b);
inline Vec3 minus(const Vec3& a, const Vec3& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
std::optional<Vec3> unit(const Vec3& v);  // nullopt: v has no length, or one that is not finite

// Returns a column of the matrix: 0 to 2 are the images of the axes, 3 is that of the origin.
inline Vec3 column(const Transform& t, std::size_t i) { return {t.m[i], t.m[4 + i], t.m[8 + i]}; }
Transform of_columns(const Vec3& x, const Vec3& y, const Vec3& z, const Vec3& origin);
Transform multiply(const Transform& a, const Transform& b);
Vec3 transform_point(const Transform& t, const Vec3& p);  // uses the affine part only
Vec3 transform_vector(const Transform& t, const Vec3& v);
double determinant3(const Transform& t);  // determinant of the linear part

// True if all elements of the matrix and of its inverse are finite, and the determinant of the linear part is
// a normal number: not 0, subnormal or infinite.
bool invertible(const Transform& t);
// True if the matrix consists only of translation, rotation and reflection, up to 1e-3 as Mitsuba 3 requires
// of sensors.
bool is_rigid(const Transform& t);

// Reads a <transform>: the product of its steps, each applied after the previous ones. Reports and skips
// wrong steps.
Transform read_transform(const Element& e, Report& report);
// True if the singular values of the linear part are equal within the rounding of single precision: the
// matrix scales equally in all directions.
bool is_similarity(const Transform& t);
// Returns the part of a 4 x 4 matrix that maps x and y to x and y, with their translation. Mitsuba 3 uses
// this part for textures.
UvTransform uv_part(const Transform& t);

// Reads x, y, z or value="..." of <translate>, <rotate>, <scale>, <vector> or <point>; missing components
// become `missing`.
std::optional<Vec3> read_xyz(const Element& e, double missing, Report& report);
// Returns the place of the attribute's value, or of the element if it has no such attribute.
Span value_place(const Element& e, std::string_view attribute);

}  // namespace ls::scene
