// Motion by keys: where something is at times of the exposure, and between them.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "core/scene/scene.h"

namespace ls::scene {

// Decomposes a transform: a scaling along the axes, then a turn, then a move. A mirrored one has a negative scale along
// x. Returns nullopt if the transform shears by more than a thousandth of a radian, or cannot be inverted.
std::optional<MotionKey> motion_key(double time, const Transform& t);
Transform pose_of(const MotionKey& key);

// Returns the key at this time. Between two keys, scale and place are interpolated linearly, and the turn at a constant
// rate along the shorter way (slerp: Shoemake, "Animating rotation with quaternion curves", SIGGRAPH 1985), as in Mitsuba
// 3. Before the first key and after the last one nothing moves. `keys` are at least one, in the order of their times.
MotionKey key_at(std::span<const MotionKey> keys, double time);

// Returns the part of a motion that happens between two times, with the times of the result from 0 to 1. Empty if nothing
// moves between them.
std::vector<MotionKey> motion_during(std::span<const MotionKey> keys, double open, double close);

}  // namespace ls::scene
