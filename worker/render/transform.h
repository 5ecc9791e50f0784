// Affine maps in double: scene transforms before anything is rounded to float32.
#pragma once

#include <array>
#include <cmath>

#include "common/scene/scene.h"
#include "worker/render/math.h"

namespace ls::render {

struct Affine {
  std::array<double, 9> a{1, 0, 0, 0, 1, 0, 0, 0, 1};  // row-major linear part
  V3d b{0, 0, 0};

  Affine() = default;
  explicit Affine(const Transform& t)
      : a{t.m[0], t.m[1], t.m[2], t.m[4], t.m[5], t.m[6], t.m[8], t.m[9], t.m[10]},
        b(t.m[3], t.m[7], t.m[11]) {}

  V3d vector(const V3d& v) const {
    return {a[0] * v.x + a[1] * v.y + a[2] * v.z, a[3] * v.x + a[4] * v.y + a[5] * v.z,
            a[6] * v.x + a[7] * v.y + a[8] * v.z};
  }
  V3d point(const V3d& p) const { return vector(p) + b; }
  // Cofactor matrix: the inverse transpose times the determinant; right for normals of mirrored maps too up
  // to its sign.
  V3d normal(const V3d& n) const {
    const V3d x(a[0], a[3], a[6]), y(a[1], a[4], a[7]), z(a[2], a[5], a[8]);
    return y.cross(z) * n.x + z.cross(x) * n.y + x.cross(y) * n.z;
  }
  double determinant() const {
    const V3d x(a[0], a[3], a[6]), y(a[1], a[4], a[7]), z(a[2], a[5], a[8]);
    return x.dot(y.cross(z));
  }
  bool finite() const {
    for (double v : a)
      if (!std::isfinite(v)) return false;
    return std::isfinite(b.x) && std::isfinite(b.y) && std::isfinite(b.z);
  }
  // Finite both ways. A subnormal determinant has no finite inverse, one that overflows no finite map.
  bool invertible() const { return finite() && std::isnormal(determinant()) && inverse().finite(); }
  // Of an invertible map.
  Affine inverse() const {
    const double d = 1 / determinant();
    Affine r;
    r.a = {(a[4] * a[8] - a[5] * a[7]) * d, (a[2] * a[7] - a[1] * a[8]) * d, (a[1] * a[5] - a[2] * a[4]) * d,
           (a[5] * a[6] - a[3] * a[8]) * d, (a[0] * a[8] - a[2] * a[6]) * d, (a[2] * a[3] - a[0] * a[5]) * d,
           (a[3] * a[7] - a[4] * a[6]) * d, (a[1] * a[6] - a[0] * a[7]) * d, (a[0] * a[4] - a[1] * a[3]) * d};
    r.b = -r.vector(b);
    return r;
  }
  Affine operator*(const Affine& o) const {  // this after o
    Affine r;
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) {
        r.a[3 * i + j] = a[3 * i] * o.a[j] + a[3 * i + 1] * o.a[3 + j] + a[3 * i + 2] * o.a[6 + j];
      }
    r.b = point(o.b);
    return r;
  }
  static Affine scale_translate(double s, const V3d& t) {
    Affine r;
    r.a = {s, 0, 0, 0, s, 0, 0, 0, s};
    r.b = t;
    return r;
  }
};

}  // namespace ls::render
