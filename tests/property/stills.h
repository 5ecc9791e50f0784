// Scenes in which something moves, and images of stills of them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/scene/motion.h"
#include "tests/property/quarters.h"
#include "worker/render/math/random.h"

namespace ls::test {

// Lets the camera, a shape or an instance move by these poses at equal steps of time.
template <class T>
void move(Scene& scene, T& object, const std::vector<Transform>& poses) {
  std::vector<MotionKey> keys;
  for (const Transform& pose : poses) keys.push_back({static_cast<double>(keys.size()), pose});
  object.motion = scene::motion_during(scene::Motion(keys), 0, static_cast<double>(keys.size() - 1));
  object.to_world = scene::Motion(object.motion).at(.5);
  scene.sensor.shutter_close = 1;
}

// Returns the scene with all that moves where it is at a time of the exposure.
inline SceneBuilder stopped(SceneBuilder b, double time) {
  const auto stop = [&](auto& object) {
    if (object.motion.empty()) return;
    object.to_world = scene::Motion(object.motion).at(time);
    object.motion.clear();
  };
  for (Shape& s : b.scene.shapes) stop(s);
  for (Instance& i : b.scene.instances) stop(i);
  stop(b.scene.sensor);
  b.scene.sensor.shutter_close = 0;
  return b;
}

// An image of `stills` stills, each at a random time of its part of the exposure.
inline QuarterImage of_stills(const SceneBuilder& moving, int stills, std::uint64_t spp, std::uint64_t seed) {
  render::RandomStream dice(seed);
  QuarterImage mean{};
  const auto count = static_cast<std::uint64_t>(stills);
  for (std::uint64_t k = 0; k < count; ++k) {
    const double time = (static_cast<double>(k) + double{dice.uniform()}) / stills;
    const QuarterImage still = quarter_image(stopped(moving, time), spp / count, seed * count + k);
    for (std::size_t q = 0; q < kQuarters; ++q) mean[q] += still[q] / stills;
  }
  return mean;
}

// Expects the image of what moves to be the mean of stills. `level`: as in expect_same_quarters().
inline void expect_mean_of_stills(const char* name, double level, const SceneBuilder& moving) {
  constexpr int kSeeds = 24, kStills = 8;
  constexpr std::uint64_t kSpp = 64;
  const auto stills = [&](int i) {
    return of_stills(moving, kStills, kSpp, 900 + static_cast<std::uint64_t>(i));
  };
  expect_same_quarters(name, level, quarters_of(moving, kSpp, kSeeds, 100), quarters_of(kSeeds, stills),
                       kSeeds);
}

}  // namespace ls::test
