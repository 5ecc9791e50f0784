// The interface to Embree: finds which primitive a ray meets, nothing else (Geometry::complete computes
// distances and positions, so that no reciprocal estimate of the processor reaches the image).
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <string>

#include "common/base/error.h"
#include "worker/render/geometry/geometry.h"

namespace ls::render {

// Primitives ordered by kind, index and instance.
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

  // `geometry` must not move during the lifetime of the result: the BVH reads its arrays in place.
  // `coincident` enables between(); it costs a little at each triangle hit.
  static Result<Accel> build(const Geometry& geometry, int threads, bool coincident = false);

  // The nearest primitive in (0, t_max); directions need not be of unit length.
  std::optional<PrimitiveId> nearest(const V3& o, const V3& d, float t_max) const;
  // The nearest boundary with full or partial null transmission in (0, t_max).
  std::optional<PrimitiveId> nearest_boundary(const V3& o, const V3& d, float t_max) const;
  // All primitives met on the straight line from a to b, at most CoincidentHits::kMost. Only in a world that
  // was built with `coincident`.
  CoincidentHits between(const V3& a, const V3& b) const;
  // True if an opaque primitive is met in (0, t_max).
  bool occluded(const V3& o, const V3& d, float t_max) const;

  bool has_boundaries() const;
  std::uint64_t bytes() const;  // as Embree reports them
  // Embree's version and the instruction set that it is configured to use; part of the numeric class.
  static std::string describe();

  struct State;

 private:
  std::unique_ptr<State> state_;
};

}  // namespace ls::render
