// One time of the exposure: where the instances that move are then.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "worker/render/geometry/geometry.h"

namespace ls::render {

// Not for several threads at once: it remembers the places that it has computed.
class Moment {
 public:
  Moment() = default;
  Moment(const Geometry& geometry, float time) { begin(geometry, time); }

  // `time` is from 0 to 1. The geometry must outlive what is asked later.
  void begin(const Geometry& geometry, float time) {
    geometry_ = &geometry;
    time_ = time;
    for (std::optional<Kept>& kept : kept_) kept.reset();
  }
  float time() const { return time_; }
  // Returns where the instance is. The reference holds until the next call for another instance.
  const PlacedInstance& placed(std::uint32_t instance) const {
    const PlacedInstance& still = geometry_->instances[instance];
    if (still.moving == kNone) return still;
    std::optional<Kept>& kept = kept_[instance % kept_.size()];
    if (!kept || kept->instance != instance) kept = {instance, placed_at(*geometry_, instance, time_)};
    return kept->placed;
  }

 private:
  struct Kept {
    std::uint32_t instance;
    PlacedInstance placed;
  };

  const Geometry* geometry_ = nullptr;
  float time_ = 0;
  mutable std::array<std::optional<Kept>, 4> kept_;
};

}  // namespace ls::render
