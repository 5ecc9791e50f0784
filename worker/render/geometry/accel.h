// The interface to Embree. Embree is used only to find the primitive that a ray hits. Geometry::complete then
// computes the distance and the position itself. Embree computes them with the processor's approximate
// reciprocals, which differ between processors, so its results would make images differ, too.
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <string>

#include "core/base/error.h"
#include "worker/render/geometry/geometry.h"

namespace ls::render {

// The primitives that Accel::between() found along a line, at most kMost, ordered by kind, index and
// instance.
struct CoincidentHits {
  static constexpr int kMost = 64;
  std::array<PrimitiveId, kMost> ids;
  int count = 0;
};

class Accel {
 public:
  Accel();
  ~Accel();
  Accel(Accel&&) noexcept;
  Accel& operator=(Accel&&) noexcept;

  // `geometry` must not move during the lifetime of the result, since the BVH reads its arrays in place.
  // `coincident` enables between(), at a small cost for each triangle hit.
  static Result<Accel> build(const Geometry& geometry, int threads, bool coincident = false);

  // Returns the nearest primitive that the ray o + t d hits at a t in (0, t_max). Here and below d need not
  // be of unit length, and instances that move are where they are at time 0 of the exposure or, with
  // `moment`, at its time.
  std::optional<PrimitiveId> nearest(const V3& o, const V3& d, float t_max) const;
  std::optional<PrimitiveId> nearest(const V3& o, const V3& d, float t_max, const Moment& moment) const;
  // Returns the nearest primitive at a t in (0, t_max) that lets light pass straight through, completely or
  // partly.
  std::optional<PrimitiveId> nearest_boundary(const V3& o, const V3& d, float t_max) const;
  std::optional<PrimitiveId> nearest_boundary(const V3& o, const V3& d, float t_max,
                                              const Moment& moment) const;
  // Returns the primitives that the straight line from a to b hits, at most CoincidentHits::kMost. Requires
  // that build() was called with `coincident`.
  CoincidentHits between(const V3& a, const V3& b, const Moment* moment = nullptr) const;
  // True if the ray o + t d hits an opaque primitive at a t in (0, t_max).
  bool occluded(const V3& o, const V3& d, float t_max) const;
  bool occluded(const V3& o, const V3& d, float t_max, const Moment& moment) const;

  bool has_boundaries() const;
  std::uint64_t bytes() const;  // memory of the BVH, as Embree reports it
  // Embree's version and the instruction set that it is configured to use. The text is part of the numeric
  // class, the digest that identifies machines that render the same bits (numeric_class() in render.h).
  static std::string describe();
  static std::string version();  // of Embree, such as "4.3.3"

  struct State;

 private:
  std::unique_ptr<State> state_;
};

}  // namespace ls::render
