// The door to Embree: which primitive a ray meets, and nothing else (distances and positions are computed by
// Geometry::complete, so that no reciprocal estimate of the processor reaches the image).
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <string>

#include "common/base/error.h"
#include "worker/render/geometry.h"

namespace ls::render {

// Primitives in order of kind, index and instance.
struct Together {
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

  // `geometry` must stay where it is while this lives: the BVH reads its arrays in place.
  // `coincident`: between() will be asked; it costs a little where triangles are met.
  static Result<Accel> build(const Geometry& geometry, int threads, bool coincident = false);

  // The nearest primitive in (0, t_max); directions need not be of unit length.
  std::optional<PrimitiveId> nearest(const V3& o, const V3& d, float t_max) const;
  // The nearest boundary that lets light pass, all or a share of it, in (0, t_max).
  std::optional<PrimitiveId> nearest_boundary(const V3& o, const V3& d, float t_max) const;
  // All that is met on the straight way from a to b, up to Together::kMost. Only in a world that was built
  // for it (`coincident`).
  Together between(const V3& a, const V3& b) const;
  // Whether an opaque primitive is met in (0, t_max).
  bool occluded(const V3& o, const V3& d, float t_max) const;

  bool has_boundaries() const;
  std::uint64_t bytes() const;  // as Embree reports them
  // Embree's version and the instruction set it was told to use; part of the numeric class.
  static std::string describe();

  struct State;

 private:
  std::unique_ptr<State> state_;
};

}  // namespace ls::render
