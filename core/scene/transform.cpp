#include "core/scene/transform.h"

#include <algorithm>
#include <cmath>

namespace ls::scene {
namespace {

constexpr double kRigidTolerance = 1e-3;  // of Mitsuba 3, too

}  // namespace

double dot(const Vec3& a, const Vec3& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
Vec3 cross(const Vec3& a, const Vec3& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

std::optional<Vec3> unit(const Vec3& v) {
  const double length = std::sqrt(dot(v, v));
  if (!std::isnormal(length)) return std::nullopt;
  return Vec3{{v[0] / length, v[1] / length, v[2] / length}};
}

Transform of_columns(const Vec3& x, const Vec3& y, const Vec3& z, const Vec3& origin) {
  return {
      {x[0], y[0], z[0], origin[0], x[1], y[1], z[1], origin[1], x[2], y[2], z[2], origin[2], 0, 0, 0, 1}};
}

Transform multiply(const Transform& a, const Transform& b) {
  Transform out;
  for (std::size_t i = 0; i < 4; ++i)
    for (std::size_t j = 0; j < 4; ++j) {
      double sum = 0;
      for (std::size_t k = 0; k < 4; ++k) sum += a.m[4 * i + k] * b.m[4 * k + j];
      out.m[4 * i + j] = sum;
    }
  return out;
}

Vec3 transform_vector(const Transform& t, const Vec3& v) {
  Vec3 out;
  for (std::size_t i = 0; i < 3; ++i)
    out[i] = t.m[4 * i] * v[0] + t.m[4 * i + 1] * v[1] + t.m[4 * i + 2] * v[2];
  return out;
}

Vec3 transform_point(const Transform& t, const Vec3& p) {
  const Vec3 v = transform_vector(t, p);
  return {v[0] + t.m[3], v[1] + t.m[7], v[2] + t.m[11]};
}

double determinant3(const Transform& t) { return dot(column(t, 0), cross(column(t, 1), column(t, 2))); }

bool invertible(const Transform& t) {
  const auto finite = [](double x) { return std::isfinite(x); };
  // A subnormal determinant is refused, since its reciprocal, the determinant of the inverse, may be
  // infinite.
  const double d = determinant3(t);
  if (!std::all_of(t.m.begin(), t.m.end(), finite) || !std::isnormal(d)) return false;
  // Elements of the inverse may overflow although the determinant is normal. They are computed here by the
  // same products as in the renderer, which would otherwise find the overflow only when it builds the world.
  const Vec3 a = column(t, 0), b = column(t, 1), c = column(t, 2), moved = origin_of(t);
  for (const Vec3& cofactors : {cross(b, c), cross(c, a), cross(a, b)}) {
    const Vec3 row{cofactors[0] * (1 / d), cofactors[1] * (1 / d), cofactors[2] * (1 / d)};
    if (!std::all_of(row.begin(), row.end(), finite) || !finite(dot(row, moved))) return false;
  }
  return true;
}

// Checks that M transpose(M) is the identity, where M is the linear part (the upper left 3 x 3 matrix) of t.
bool is_rigid(const Transform& t) {
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = i; j < 3; ++j) {
      double product = 0;
      for (std::size_t k = 0; k < 3; ++k) product += t.m[4 * i + k] * t.m[4 * j + k];
      if (!(std::abs(product - (i == j ? 1 : 0)) <= kRigidTolerance)) return false;
    }
  return true;
}

bool is_similarity(const Transform& t) {
  const Vec3 columns[3] = {column(t, 0), column(t, 1), column(t, 2)};
  const double size = dot(columns[0], columns[0]);
  // Files often give numbers with six digits, so the squares of equal lengths may differ by a few 1e-6 of
  // their value.
  const double slack = 1e-5 * size;
  return std::abs(dot(columns[1], columns[1]) - size) <= slack &&
         std::abs(dot(columns[2], columns[2]) - size) <= slack &&
         std::abs(dot(columns[0], columns[1])) <= slack && std::abs(dot(columns[0], columns[2])) <= slack &&
         std::abs(dot(columns[1], columns[2])) <= slack;
}

UvTransform uv_part(const Transform& t) {
  return {{t.m[0], t.m[1], t.m[3], t.m[4], t.m[5], t.m[7], 0, 0, 1}};
}

}  // namespace ls::scene
