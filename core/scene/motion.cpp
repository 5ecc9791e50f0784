#include "core/scene/motion.h"

#include <algorithm>
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
double length(const Vec3& v) { return std::hypot(v[0], v[1], v[2]); }

// The quaternion of the rotation whose matrix has these columns. The largest of the four components is
// computed first, from its square, so that none is divided by a small one (Shepperd, "Quaternion from
// rotation matrix", 1978).
Quaternion quaternion(const Vec3& x, const Vec3& y, const Vec3& z) {
  const double trace = x[0] + y[1] + z[2];
  if (trace >= std::max({x[0], y[1], z[2]}))
    return normalized({y[2] - z[1], z[0] - x[2], x[1] - y[0], 1 + trace});
  if (x[0] >= std::max(y[1], z[2]))
    return normalized({1 + x[0] - y[1] - z[2], x[1] + y[0], z[0] + x[2], y[2] - z[1]});
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

// The axes of the transform, of unit length.
std::array<Vec3, 3> axes(const Transform& t) {
  std::array<Vec3, 3> all;
  for (std::size_t i = 0; i < 3; ++i) {
    const Vec3 c = column(t, i);
    all[i] = scaled(c, 1 / length(c));
  }
  return all;
}

}  // namespace

bool can_move(const Transform& t) {
  if (!invertible(t)) return false;
  const auto [x, y, z] = axes(t);
  return std::abs(dot(x, y)) <= kShear && std::abs(dot(y, z)) <= kShear && std::abs(dot(z, x)) <= kShear;
}

Motion::Parts Motion::parts_of(const Transform& t) {
  auto [x, y, z] = axes(t);
  Parts parts;
  parts.translation = origin_of(t);
  parts.scale = {{length(column(t, 0)), length(column(t, 1)), length(column(t, 2))}};
  if (dot(x, cross(y, z)) < 0) parts.scale[0] = -parts.scale[0];
  // The small shear that is left goes out by making the axes perpendicular, z first.
  y = minus(y, scaled(z, dot(y, z)));
  y = scaled(y, 1 / length(y));
  parts.rotation = quaternion(cross(y, z), y, z);
  return parts;
}

Transform Motion::pose_of(const Parts& parts) {
  const auto& [x, y, z, w] = parts.rotation;
  const Vec3 a{{1 - 2 * (y * y + z * z), 2 * (x * y + z * w), 2 * (x * z - y * w)}};
  const Vec3 b{{2 * (x * y - z * w), 1 - 2 * (x * x + z * z), 2 * (y * z + x * w)}};
  const Vec3 c{{2 * (x * z + y * w), 2 * (y * z - x * w), 1 - 2 * (x * x + y * y)}};
  return of_columns(scaled(a, parts.scale[0]), scaled(b, parts.scale[1]), scaled(c, parts.scale[2]),
                    parts.translation);
}

Motion::Parts Motion::between(const Parts& a, const Parts& b, double t) {
  return {mixed(a.scale, b.scale, t), slerp(a.rotation, b.rotation, t),
          mixed(a.translation, b.translation, t)};
}

Motion::Motion(std::span<const MotionKey> keys) : keys_(keys.begin(), keys.end()) {
  for (const MotionKey& key : keys_) parts_.push_back(parts_of(key.to_world));
}

Transform Motion::at(double time) const {
  const auto after = std::upper_bound(keys_.begin(), keys_.end(), time,
                                      [](double t, const MotionKey& k) { return t < k.time; });
  if (after == keys_.begin()) return keys_.front().to_world;
  const MotionKey& before = after[-1];
  if (after == keys_.end() || before.time == time || before.to_world == after->to_world)
    return before.to_world;
  const auto i = static_cast<std::size_t>(after - keys_.begin());
  return pose_of(between(parts_[i - 1], parts_[i], (time - before.time) / (after->time - before.time)));
}

std::vector<MotionKey> motion_during(const Motion& motion, double open, double close) {
  std::vector<MotionKey> during;
  if (motion.empty() || !(open < close)) return during;
  during.push_back({open, motion.at(open)});
  for (const MotionKey& key : motion.keys())
    if (key.time > open && key.time < close) during.push_back(key);
  during.push_back({close, motion.at(close)});
  const Transform& first = during.front().to_world;
  if (std::all_of(during.begin(), during.end(), [&](const MotionKey& k) { return k.to_world == first; }))
    return {};
  for (MotionKey& key : during) key.time = (key.time - open) / (close - open);
  // Rounding may give neighbours the same time; each then gets the next one, so that a jump stays a jump.
  during.back().time = 1;
  for (std::size_t i = 1; i < during.size(); ++i)
    if (!(during[i].time > during[i - 1].time)) during[i].time = std::nextafter(during[i - 1].time, 2.);
  during.back().time = 1;
  for (std::size_t i = during.size() - 1; i > 0; --i)
    if (!(during[i - 1].time < during[i].time)) during[i - 1].time = std::nextafter(during[i].time, -1.);
  return during;
}

}  // namespace ls::scene
