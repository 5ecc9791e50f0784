#include "core/scene/motion.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/scene/transform.h"

namespace ls::scene {
namespace {

using Quaternion = std::array<double, 4>;  // x, y, z, w

constexpr double kShear = 1e-3;  // the cosine between two axes of a transform that counts as none

double dot4(const Quaternion& a, const Quaternion& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3];
}
Quaternion normalized(const Quaternion& q) {
  const double n = std::sqrt(dot4(q, q));
  return {q[0] / n, q[1] / n, q[2] / n, q[3] / n};
}
Vec3 scaled(const Vec3& v, double s) { return {{v[0] * s, v[1] * s, v[2] * s}}; }

// The quaternion of the rotation whose matrix has these columns. The largest of the four components is computed first,
// from its square, so that none is divided by a small one (Shepperd, "Quaternion from rotation matrix", 1978).
Quaternion quaternion(const Vec3& x, const Vec3& y, const Vec3& z) {
  const double trace = x[0] + y[1] + z[2];
  if (trace >= std::max({x[0], y[1], z[2]}))
    return normalized({y[2] - z[1], z[0] - x[2], x[1] - y[0], 1 + trace});
  if (x[0] >= std::max(y[1], z[2])) return normalized({1 + x[0] - y[1] - z[2], x[1] + y[0], z[0] + x[2], y[2] - z[1]});
  if (y[1] >= z[2]) return normalized({x[1] + y[0], 1 + y[1] - x[0] - z[2], y[2] + z[1], z[0] - x[2]});
  return normalized({z[0] + x[2], y[2] + z[1], 1 + z[2] - x[0] - y[1], x[1] - y[0]});
}

Quaternion slerp(const Quaternion& a, Quaternion b, double t) {
  if (dot4(a, b) < 0) b = {-b[0], -b[1], -b[2], -b[3]};
  Quaternion less, more;
  for (std::size_t i = 0; i < 4; ++i) less[i] = b[i] - a[i], more[i] = b[i] + a[i];
  // The angle between them, at most a right one. Its arc cosine would be inexact for small ones.
  const double angle = 2 * std::atan2(std::sqrt(dot4(less, less)), std::sqrt(dot4(more, more)));
  const double sine = std::sin(angle);
  const double of_a = sine > 0 ? std::sin((1 - t) * angle) / sine : 1 - t,
               of_b = sine > 0 ? std::sin(t * angle) / sine : t;
  Quaternion q;
  for (std::size_t i = 0; i < 4; ++i) q[i] = of_a * a[i] + of_b * b[i];
  return normalized(q);
}

double mixed(double a, double b, double t) { return a == b ? a : (1 - t) * a + t * b; }
Vec3 mixed(const Vec3& a, const Vec3& b, double t) {
  return {{mixed(a[0], b[0], t), mixed(a[1], b[1], t), mixed(a[2], b[2], t)}};
}

}  // namespace

std::optional<MotionKey> motion_key(double time, const Transform& t) {
  if (!invertible(t)) return std::nullopt;
  Vec3 x = column(t, 0), y = column(t, 1), z = column(t, 2);
  MotionKey key;
  key.time = time;
  key.translation = origin_of(t);
  key.scale = {{std::sqrt(dot(x, x)), std::sqrt(dot(y, y)), std::sqrt(dot(z, z))}};
  if (determinant3(t) < 0) key.scale[0] = -key.scale[0];
  x = scaled(x, 1 / key.scale[0]), y = scaled(y, 1 / key.scale[1]), z = scaled(z, 1 / key.scale[2]);
  if (std::max({std::abs(dot(x, y)), std::abs(dot(y, z)), std::abs(dot(z, x))}) > kShear) return std::nullopt;
  // The small shear that is left goes out by making the axes perpendicular, z first.
  const auto flat = unit(minus(y, scaled(z, dot(y, z))));
  if (!flat) return std::nullopt;
  y = *flat;
  key.rotation = quaternion(cross(y, z), y, z);
  return key;
}

Transform pose_of(const MotionKey& key) {
  const auto& [x, y, z, w] = key.rotation;
  const Vec3 a{{1 - 2 * (y * y + z * z), 2 * (x * y + z * w), 2 * (x * z - y * w)}};
  const Vec3 b{{2 * (x * y - z * w), 1 - 2 * (x * x + z * z), 2 * (y * z + x * w)}};
  const Vec3 c{{2 * (x * z + y * w), 2 * (y * z - x * w), 1 - 2 * (x * x + y * y)}};
  return of_columns(scaled(a, key.scale[0]), scaled(b, key.scale[1]), scaled(c, key.scale[2]), key.translation);
}

MotionKey key_at(std::span<const MotionKey> keys, double time) {
  const auto after =
      std::upper_bound(keys.begin(), keys.end(), time, [](double t, const MotionKey& k) { return t < k.time; });
  MotionKey at = after == keys.begin() ? keys.front() : after[-1];
  if (after != keys.begin() && after != keys.end() && at.time < time) {
    const double t = (time - at.time) / (after->time - at.time);
    at.scale = mixed(at.scale, after->scale, t);
    at.rotation = slerp(at.rotation, after->rotation, t);
    at.translation = mixed(at.translation, after->translation, t);
  }
  at.time = time;
  return at;
}

std::vector<MotionKey> motion_during(std::span<const MotionKey> keys, double open, double close) {
  std::vector<MotionKey> during;
  if (keys.empty() || !(open < close)) return during;
  during.push_back(key_at(keys, open));
  for (const MotionKey& key : keys)
    if (key.time > open && key.time < close) during.push_back(key);
  during.push_back(key_at(keys, close));
  bool moves = false;
  for (MotionKey& key : during) {
    key.time = (key.time - open) / (close - open);
    moves = moves || key.scale != during.front().scale || key.rotation != during.front().rotation ||
            key.translation != during.front().translation;
  }
  // Rounding may give neighbours the same time.
  const auto same = [](const MotionKey& a, const MotionKey& b) { return !(a.time < b.time); };
  during.erase(std::unique(during.begin(), during.end(), same), during.end());
  if (!moves || during.size() < 2) return {};
  during.back().time = 1;
  return during;
}

}  // namespace ls::scene
