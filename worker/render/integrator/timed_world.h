// The world as one path finds it: what rays meet and what lights give at the time of the path.
#pragma once

#include <optional>
#include <type_traits>

#include "worker/render/geometry/moment.h"
#include "worker/render/integrator/offset_ray.h"
#include "worker/render/world/world.h"

namespace ls::render {

// With kMotion, instances that move are where they are at the path's time; otherwise nothing moves. The
// functions are those of Accel, Geometry and Lights.
template <bool kMotion>
class TimedWorld {
 public:
  explicit TimedWorld(const World& world) : world_(world) {}

  // Sets the time to that of a camera ray, and returns the first ray of its path.
  OffsetRay begin(const CameraRay& ray) {
    if constexpr (kMotion) moment_.begin(world_.geometry, ray.time);
    return {ray.o, ray.o, ray.d};
  }
  std::optional<PrimitiveId> nearest(const V3& o, const V3& d, float t_max) const {
    if constexpr (kMotion) return world_.accel.nearest(o, d, t_max, moment_);
    return world_.accel.nearest(o, d, t_max);
  }
  std::optional<PrimitiveId> nearest_boundary(const V3& o, const V3& d, float t_max) const {
    if constexpr (kMotion) return world_.accel.nearest_boundary(o, d, t_max, moment_);
    return world_.accel.nearest_boundary(o, d, t_max);
  }
  CoincidentHits between(const V3& a, const V3& b) const {
    if constexpr (kMotion) return world_.accel.between(a, b, &moment_);
    return world_.accel.between(a, b);
  }
  bool occluded(const V3& o, const V3& d, float t_max) const {
    if constexpr (kMotion) return world_.accel.occluded(o, d, t_max, moment_);
    return world_.accel.occluded(o, d, t_max);
  }
  bool complete(PrimitiveId id, const V3& o, const V3& d, SurfaceHit& hit) const {
    if constexpr (kMotion) return world_.geometry.complete(id, o, d, moment_, hit);
    return world_.geometry.complete(id, o, d, hit);
  }
  std::optional<LightSample> sample_light(const LightChoice& choice, const V3& x) const {
    if constexpr (kMotion) return world_.lights.sample(choice, x, moment_);
    return world_.lights.sample(choice, x);
  }
  template <class Of>
  Pivot light_pivot(const Of& choice_or_hit) const {
    if constexpr (kMotion) return world_.lights.pivot(choice_or_hit, moment_);
    return world_.lights.pivot(choice_or_hit);
  }
  float light_pdf(const SurfaceHit& hit, const V3& x, const V3& direction, const LightPlace& place,
                  bool before_point) const {
    if constexpr (kMotion) return world_.lights.pdf(hit, x, direction, place, before_point, moment_);
    return world_.lights.pdf(hit, x, direction, place, before_point);
  }

 protected:
  const World& world_;

 private:
  struct Nothing {};
  std::conditional_t<kMotion, Moment, Nothing> moment_;
};

}  // namespace ls::render
