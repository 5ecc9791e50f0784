// The distribution of the directions in which a path leaves a vertex in a medium or on a surface. It is a
// mixture of the vertex's own distribution (the phase function or the BSDF) and of a distribution that
// prefers directions that pass close to a lamp (a light without extent).
//
// The light scattered at distance D from a lamp is proportional to 1 / D^2. Its integral along a ray whose
// smallest distance to the lamp is D is proportional to 1 / D, with D = r sin(theta) for a ray from a vertex
// at distance r that makes the angle theta with the direction to the lamp. If directions are sampled with a
// bounded density, the second moment of 1 / sin(theta) is infinite, which shows as fireflies. With a density
// proportional to 1 / sin(theta) it is finite.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "worker/render/math/math.h"

namespace ls::render {

inline constexpr std::size_t kMaxLamps = 4;
// The probability of sampling a direction near a lamp.
inline constexpr float kLampShare = .25f;

struct Lamps {
  std::array<V3, kMaxLamps> position;
  std::size_t count = 0;
};

class LampDirections {
 public:
  LampDirections() = default;  // without lamps the mixture is the vertex's own distribution
  LampDirections(const Lamps& lamps, const V3& p) {
    for (std::size_t i = 0; i < lamps.count; ++i) {
      const V3 to = lamps.position[i] - p;
      const float l2 = dot(to, to);
      if (l2 > 0) to_lamp_[count_++] = to * (1 / std::sqrt(l2));
    }
  }
  bool any() const { return count_ > 0; }
  float own_share() const { return count_ > 0 ? 1 - kLampShare : 1.f; }

  // The density of the mixture at w, per steradian. `own` is the density of the vertex's own distribution.
  float pdf(float own, const V3& w) const {
    if (count_ == 0) return own;
    float sum = 0;
    for (std::size_t i = 0; i < count_; ++i) sum += near_pdf(to_lamp_[i], w);
    return (1 - kLampShare) * own + kLampShare / static_cast<float>(count_) * sum;
  }
  // Chooses one of the two distributions by the random number `choice` in [0, 1). If it is that of the lamps,
  // returns a direction sampled from it by u. If it is the vertex's own, returns nullopt and rescales
  // `choice` to be uniform in [0, 1) again, for the caller to use.
  std::optional<V3> sample(float& choice, V2 u) const {
    if (count_ == 0) return std::nullopt;
    if (choice < kLampShare) {
      const auto which = static_cast<std::size_t>(choice / kLampShare * static_cast<float>(count_));
      return near(to_lamp_[std::min(which, count_ - 1)], u);
    }
    choice = std::min((choice - kLampShare) / (1 - kLampShare), kBelowOne);
    return std::nullopt;
  }

 private:
  // The density with which near() samples w. sin(theta) is bounded from below by 1e-6, because it is accurate
  // only to about 1e-7. So for directions very close to the lamp the result is less than the true density,
  // but all MIS weights use this same function.
  static float near_pdf(const V3& to_lamp, const V3& w) {
    const V3 c = cross(to_lamp, w);
    return kInvTwoPi * kInvPi / std::max(std::sqrt(dot(c, c)), 1e-6f);
  }
  static V3 near(const V3& to_lamp, V2 u) {
    const V2 theta = unit_circle(.5f * u.x), phi = unit_circle(u.y);
    return normalize(Frame(to_lamp).to_world({theta.y * phi.x, theta.y * phi.y, theta.x}));
  }

  std::array<V3, kMaxLamps> to_lamp_;
  std::size_t count_ = 0;
};

}  // namespace ls::render
