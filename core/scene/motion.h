// Motion by keys: where something is at times of the exposure, and between them.
#pragma once

#include <array>
#include <span>
#include <string_view>
#include <vector>

#include "core/scene/scene.h"

namespace ls::scene {

// True if the transform only scales along its own axes (and may mirror), turns and moves, and can be
// inverted. Its axes may be off a right angle by a thousandth of a radian, which is lost where it moves.
bool can_move(const Transform& t);

// A motion with its transforms taken apart, for the poses between its keys.
class Motion {
 public:
  Motion() = default;
  // `keys`: none, or at least one, in the order of their times, whose transforms can_move().
  explicit Motion(std::span<const MotionKey> keys);

  bool empty() const { return keys_.empty(); }
  std::span<const MotionKey> keys() const { return keys_; }
  // Returns the pose at this time: at a key its transform, bit for bit. Between two keys, scale and place are
  // interpolated linearly, and the turn at a constant rate along the shorter way (slerp: Shoemake, "Animating
  // rotation with quaternion curves", SIGGRAPH 1985), as in Mitsuba 3. Before the first key and after the
  // last one nothing moves. Not if empty().
  Transform at(double time) const;
  // Between two times at which a point is, it leaves the straight line between its two places by at most
  // this. `reach` bounds its distance from the origin of the space that moves. No key may be between the two
  // times.
  double bend(double from, double to, double reach) const;

 private:
  struct Parts {
    Vec3 scale;                      // the first is negative if the transform mirrors
    std::array<double, 4> rotation;  // a unit quaternion x, y, z, w
    Vec3 translation;
  };
  static Parts parts_of(const Transform& t);
  static Transform pose_of(const Parts& parts);
  // The turn from one key to the next one.
  struct Turn {
    std::array<double, 4> to;  // the quaternion of the next key, or its negative, which is nearer
    double angle, sine;  // between the two quaternions: half of the angle of the turn, at most a right one
  };
  static Parts between(const Parts& a, const Parts& b, const Turn& turn, double t);

  std::vector<MotionKey> keys_;
  std::vector<Parts> parts_;  // of each key
  std::vector<Turn> turns_;   // from each key but the last one
};

// True if anything in the scene moves while the shutter is open.
bool moves(const Scene& scene);

// Returns what about the shape keeps it from moving, as in "is in a group"; empty if it can move.
std::string_view why_still(const Shape& shape);

// Returns the part of a motion that happens between two times, with the times of the result from 0 to 1.
// Empty if nothing moves between them.
std::vector<MotionKey> motion_during(const Motion& motion, double open, double close);

}  // namespace ls::scene
