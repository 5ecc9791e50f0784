// Copies of groups, placed in the world, and where those that move are at each time of the exposure. A shape
// that moves by itself is a group of one shape with one instance.
#pragma once

#include <cstddef>
#include <cstdint>

#include "core/scene/motion.h"
#include "worker/render/geometry/box.h"
#include "worker/render/math/transform.h"

namespace ls::render {

inline constexpr std::uint32_t kNone = 0xffffffffu;

struct PlacedInstance {
  std::uint32_t group = 0;
  std::uint32_t moving = kNone;  // index into Geometry::moving; the maps are then those at time 0
  float mirrored = 1;            // -1 if the maps below mirror, else 1
  Affine to_world, to_local;     // maps between the world's space and the group's
};

class MovingInstance {
 public:
  // `motion` must not be empty. `to_own` maps the group's space to the space that moves. Coordinates p of the
  // scene are (p - center) * scale in the world.
  MovingInstance(scene::Motion motion, const Affine& to_own, const V3d& center, double scale)
      : motion_(std::move(motion)), to_own_(to_own), center_(center), scale_(scale) {}

  const scene::Motion& motion() const { return motion_; }
  // Returns the map from the group's space to the world's at a time of the exposure, from 0 to 1.
  Affine to_world(double time) const;
  // Returns a box of the world that holds all of the box b of the group's space at all times between two.
  Box box(const Box& b, double from, double to) const;
  // Returns into how many equal parts the exposure is divided, so that the box b of the group's space moves
  // by an eighth of its size in each at most; or into kMostParts.
  std::size_t parts(const Box& b) const;

  static constexpr std::size_t kMostParts = 64;

 private:
  scene::Motion motion_;
  Affine to_own_;
  V3d center_;
  double scale_;
};

}  // namespace ls::render
