// Vectors, frames and formulas shared by all parts of the renderer. They compute in float32, with few
// branches, unless noted otherwise.
#pragma once

#include <Imath/ImathVec.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace ls::render {

using V2 = Imath::V2f;
using V3 = Imath::V3f;
using V3d = Imath::V3d;
using C3 = Imath::V3f;  // colours and other values per channel, in linear RGB

inline constexpr float kPi = 3.14159265358979323846f;
inline constexpr double kPiD = 3.14159265358979323846;
inline constexpr float kTwoPi = 6.28318530717958647692f;
inline constexpr float kInvPi = .318309886183790671538f;
inline constexpr float kInvTwoPi = .159154943091895335769f;
inline constexpr float kInvFourPi = .0795774715459476678845f;
inline constexpr float kInfinity = std::numeric_limits<float>::infinity();
inline constexpr float kBelowOne = 0x1.fffffep-1f;  // the largest float below 1

template <class T>
constexpr T sqr(T x) {
  return x * x;
}
inline float safe_sqrt(float x) { return std::sqrt(std::max(x, 0.f)); }
inline double safe_sqrt(double x) { return std::sqrt(std::max(x, 0.)); }

inline float dot(const V3& a, const V3& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
inline V3 cross(const V3& a, const V3& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
// The result does not have unit length if v is zero or not finite, or if dot(v, v) underflows or overflows:
// callers that need unit length must check.
inline V3 normalize(const V3& v) {
  const float l2 = dot(v, v);
  return l2 > 0 ? v * (1 / std::sqrt(l2)) : v;
}
// Reflects w about the unit vector m. Both w and m, and the result, point away from the surface.
inline V3 reflect(const V3& w, const V3& m) { return m * (2 * dot(w, m)) - w; }

// The luminance of linear RGB, by the primaries of Rec. 709.
inline float luminance(const C3& c) { return .212671f * c.x + .715160f * c.y + .072169f * c.z; }
inline float max_component(const C3& c) { return std::max(c.x, std::max(c.y, c.z)); }
inline float mean_component(const C3& c) { return (c.x + c.y + c.z) * (1.f / 3); }
inline bool is_black(const C3& c) { return c.x == 0 && c.y == 0 && c.z == 0; }
inline bool is_finite(const V3& v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }

// A right-handed orthonormal frame (s, t, n) about a unit vector n (Duff et al. 2017, "Building an
// Orthonormal Basis, Revisited").
struct Frame {
  V3 s{1, 0, 0}, t{0, 1, 0}, n{0, 0, 1};

  Frame() = default;
  Frame(const V3& s_, const V3& t_, const V3& n_) : s(s_), t(t_), n(n_) {}
  explicit Frame(const V3& normal) : n(normal) {
    const float sign = std::copysign(1.f, n.z), a = -1 / (sign + n.z), b = n.x * n.y * a;
    s = {1 + sign * n.x * n.x * a, sign * b, -sign * n.x};
    t = {b, sign + n.y * n.y * a, -n.y};
  }
  // Returns the frame whose s is the projection of `tangent` onto the plane of n; an arbitrary frame if the
  // tangent is parallel to n, zero or not finite.
  static Frame from_tangent(const V3& normal, const V3& tangent) {
    const V3 s = tangent - normal * dot(normal, tangent);
    const float l2 = dot(s, s);
    if (!(l2 > 1e-12f * dot(tangent, tangent)) || !std::isfinite(l2)) return Frame(normal);
    const V3 u = s * (1 / std::sqrt(l2));
    return {u, cross(normal, u), normal};
  }
  V3 to_local(const V3& w) const { return {dot(w, s), dot(w, t), dot(w, n)}; }
  V3 to_world(const V3& l) const { return s * l.x + t * l.y + n * l.z; }
};

// Sine and cosine for |x| <= pi / 4 by Taylor series. The first omitted terms are below 2e-9 and 2e-10, so
// both are accurate to float32 rounding (about one ulp), and identical on every machine.
struct SinCos {
  float sin, cos;
};
inline SinCos sin_cos_eighth(float x) {
  const float y = x * x;
  return {x + x * y * (-1.f / 6 + y * (1.f / 120 + y * (-1.f / 5040 + y * (1.f / 362880)))),
          1 + y * (-.5f + y * (1.f / 24 + y * (-1.f / 720 + y * (1.f / 40320 + y * (-1.f / 3628800)))))};
}
// Converts a sum of samples to the float32 that is stored in a partial (the pixel sums of one unit: one tile
// and range of samples). Denormals become 0, so that the result does not depend on whether the process that
// adds up the partials treats denormals as 0.
inline float rounded(double sum) {
  const auto f = static_cast<float>(sum);
  return std::abs(f) < 0x1p-126f ? 0.f : f;
}

// Returns the point of the unit circle at angle 2 pi u, u in [0, 1]. u is reduced exactly to the nearest
// quarter turn.
inline V2 unit_circle(float u) {
  const float quarter = std::floor(4 * u + .5f);
  const SinCos a = sin_cos_eighth(kTwoPi * (u - .25f * quarter));
  const int turn = static_cast<int>(quarter) & 3;
  const float c = turn & 1 ? -a.sin : a.cos, s = turn & 1 ? a.cos : a.sin;
  return turn & 2 ? V2(-c, -s) : V2(c, s);
}

// The functions below transform uniform random numbers u in [0, 1)^2 into samples.
//
// concentric_disk() returns a point uniform on the unit disk. The map is continuous and of low distortion
// (Shirley and Chiu 1997); it maps the centre of the square to the origin.
inline V2 concentric_disk(const V2& u) {
  const float x = 2 * u.x - 1, y = 2 * u.y - 1;
  if (x == 0 && y == 0) return {0, 0};
  const bool wide = std::abs(x) > std::abs(y);
  const SinCos a = sin_cos_eighth(kPi / 4 * (wide ? y / x : x / y));
  return wide ? V2(x * a.cos, x * a.sin) : V2(y * a.sin, y * a.cos);
}
// Returns a direction whose density is cos / pi per steradian, with the cosine to +z.
inline V3 cosine_hemisphere(const V2& u) {
  const V2 d = concentric_disk(u);
  return {d.x, d.y, safe_sqrt(1 - d.x * d.x - d.y * d.y)};
}

}  // namespace ls::render
