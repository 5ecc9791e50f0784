// Computes with affine 4 x 4 matrices (Transform) and points. The linear part of such a matrix is its upper
// left 3 x 3 matrix.
#pragma once

#include <cstddef>
#include <optional>

#include "core/scene/scene.h"

namespace ls::scene {

double dot(const Vec3& a, const Vec3& b);
Vec3 cross(const Vec3& a, const Vec3& b);
inline Vec3 minus(const Vec3& a, const Vec3& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
// Returns v divided by its length; nullopt if the length is 0, subnormal or not finite.
std::optional<Vec3> unit(const Vec3& v);

// Returns column i of the matrix. Columns 0 to 2 are the images of the axes, column 3 is the image of the
// origin.
inline Vec3 column(const Transform& t, std::size_t i) { return {t.m[i], t.m[4 + i], t.m[8 + i]}; }
Transform of_columns(const Vec3& x, const Vec3& y, const Vec3& z, const Vec3& origin);
Transform multiply(const Transform& a, const Transform& b);
Vec3 transform_point(const Transform& t, const Vec3& p);  // assumes that the last row is 0 0 0 1
Vec3 transform_vector(const Transform& t, const Vec3& v);
double determinant3(const Transform& t);  // returns the determinant of the linear part

// True if all elements of the matrix and of its inverse are finite, and the determinant of the linear part is
// a normal number: not 0, subnormal or infinite.
bool invertible(const Transform& t);
// True if the matrix is composed of only translation, rotation and reflection, within the tolerance 1e-3.
// Mitsuba 3 requires this of sensors, with the same tolerance.
bool is_rigid(const Transform& t);

// True if the matrix scales equally in all directions: the columns of its linear part are perpendicular and
// equally long, up to a relative error of 1e-5 in their scalar products.
bool is_similarity(const Transform& t);
// Returns the 3 x 3 matrix for (u, v, 1) that consists of the first two rows of t without the column of z.
// Mitsuba 3 uses this part of a <transform> for textures.
UvTransform uv_part(const Transform& t);

}  // namespace ls::scene
