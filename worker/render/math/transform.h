// The scene's colours and transforms in the renderer's types. Transforms are affine maps in double, which are
// applied before coordinates are rounded to float32.
#pragma once

#include <array>
#include <cmath>

#include "core/scene/scene.h"
#include "worker/render/math/math.h"

namespace ls::render {

inline C3 color(const Rgb& c) {
  return {static_cast<float>(c[0]), static_cast<float>(c[1]), static_cast<float>(c[2])};
}

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
  // Transforms a normal: multiplies n by the cofactor matrix (inverse transpose times determinant). This is
  // correct for normals of mirroring maps too, up to sign.
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
  // True if both the map and its inverse are finite. False also if the determinant is subnormal or overflows,
  // since the inverse cannot be computed then.
  bool invertible() const { return finite() && std::isnormal(determinant()) && inverse().finite(); }
  // Returns the inverse map. This map must be invertible.
  Affine inverse() const {
    const double d = 1 / determinant();
    Affine r;
    r.a = {(a[4] * a[8] - a[5] * a[7]) * d, (a[2] * a[7] - a[1] * a[8]) * d, (a[1] * a[5] - a[2] * a[4]) * d,
           (a[5] * a[6] - a[3] * a[8]) * d, (a[0] * a[8] - a[2] * a[6]) * d, (a[2] * a[3] - a[0] * a[5]) * d,
           (a[3] * a[7] - a[4] * a[6]) * d, (a[1] * a[6] - a[0] * a[7]) * d, (a[0] * a[4] - a[1] * a[3]) * d};
    r.b = -r.vector(b);
    return r;
  }
  Affine operator*(const Affine& o) const {  // the map that applies o first, then this one
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
