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

// The angle between two quaternions. Its arc cosine would be inexact for small angles.
double angle_between(const Quaternion& a, const Quaternion& b) {
  Quaternion less, more;
  for (std::size_t i = 0; i < 4; ++i) less[i] = b[i] - a[i], more[i] = b[i] + a[i];
  return 2 * std::atan2(std::sqrt(dot4(less, less)), std::sqrt(dot4(more, more)));
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

Motion::Parts Motion::between(const Parts& a, const Parts& b, const Turn& turn, double t) {
  const double of_a = turn.sine > 0 ? std::sin((1 - t) * turn.angle) / turn.sine : 1 - t,
               of_b = turn.sine > 0 ? std::sin(t * turn.angle) / turn.sine : t;
  Quaternion q;
  for (std::size_t i = 0; i < 4; ++i) q[i] = of_a * a.rotation[i] + of_b * turn.to[i];
  return {mixed(a.scale, b.scale, t), normalized(q), mixed(a.translation, b.translation, t)};
}

Motion::Motion(std::span<const MotionKey> keys) : keys_(keys.begin(), keys.end()) {
  for (const MotionKey& key : keys_) parts_.push_back(parts_of(key.to_world));
  for (std::size_t i = 1; i < parts_.size(); ++i) {
    const Quaternion &a = parts_[i - 1].rotation, &b = parts_[i].rotation;
    const Quaternion to = dot4(a, b) < 0 ? Quaternion{-b[0], -b[1], -b[2], -b[3]} : b;
    const double angle = angle_between(a, to);
    turns_.push_back({to, angle, std::sin(angle)});
  }
}

Transform Motion::at(double time) const {
  const auto after = std::upper_bound(keys_.begin(), keys_.end(), time,
                                      [](double t, const MotionKey& k) { return t < k.time; });
  if (after == keys_.begin()) return keys_.front().to_world;
  const MotionKey& before = after[-1];
  if (after == keys_.end() || before.time == time || before.to_world == after->to_world)
    return before.to_world;
  const auto i = static_cast<std::size_t>(after - keys_.begin());
  return pose_of(
      between(parts_[i - 1], parts_[i], turns_[i - 1], (time - before.time) / (after->time - before.time)));
}

// A point x is at p = T + R S x, where the place T and the scale S change linearly in the time t that goes
// from 0 to 1 between the two keys, and R turns by the angle w at a constant rate. So the length of p'' is at
// most w^2 |S x| + 2 w |S' x|, and a curve leaves its chord over the time h by at most h^2 / 8 times that. At
// a key the pose is the key's matrix, from which the one that is put together again may differ by its
// rounding and by a small shear.
double Motion::bend(double from, double to, double reach) const {
  const auto after = std::upper_bound(keys_.begin(), keys_.end(), from,
                                      [](double t, const MotionKey& k) { return t < k.time; });
  if (after == keys_.begin() || after == keys_.end()) return 0;
  const auto i = static_cast<std::size_t>(after - keys_.begin());
  const Parts &a = parts_[i - 1], &b = parts_[i];
  const double turn = 2 * turns_[i - 1].angle;
  const double h = (to - from) / (after->time - after[-1].time);
  double scale = 0, change = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    scale = std::max({scale, std::abs(a.scale[k]), std::abs(b.scale[k])});
    change = std::max(change, std::abs(b.scale[k] - a.scale[k]));
  }
  double put_together = 0;
  for (const std::size_t key : {i - 1, i}) {
    const Transform &given = keys_[key].to_world, again = pose_of(parts_[key]);
    double squares = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3 off = minus(column(given, k), column(again, k));
      squares += dot(off, off);
    }
    put_together = std::max(put_together, std::sqrt(squares));
  }
  return reach * (h * h / 8 * turn * (turn * scale + 2 * change) + put_together);
}

bool moves(const Scene& scene) {
  const auto moving = [](const auto& one) { return !one.motion.empty(); };
  return moving(scene.sensor) || std::ranges::any_of(scene.shapes, moving) ||
         std::ranges::any_of(scene.instances, moving);
}

std::string_view why_still(const Shape& shape) {
  if (shape.group) return "is in a group";
  return shape.meter ? "is measured by a meter" : "";
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
