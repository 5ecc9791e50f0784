// Portals: the openings through which the light of the sky enters a scene.
//
// Next-event estimation samples an environment map by its brightness alone. In a room that the sky lights
// through a window, nearly all of these directions end at the walls. So camera paths are traced before the
// first sample, and the rays on which they reached the sky are kept. For each face of a box around most of
// their origins, the rays that leave through this face are intersected with several planes parallel to it.
// The plane on which the intersections are most concentrated (least entropy) is the plane of the window, or
// near it. The density of the intersections on this plane is learned. Next-event estimation samples a point
// of the plane with this density, and takes the direction to it.
//
// Other renderers let the user place portals (Bitterli, Novak and Jarosz 2015, "Portal-Masked Environment Map
// Sampling"). Here they are found automatically. They need not cover all openings, because SkyLight samples a
// mixture of the portals and the map.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "worker/render/lights/learned_rectangle.h"
#include "worker/render/math/math.h"

namespace ls::render {

class Portals {
 public:
  // Light that arrived from the sky at the point p; d is the direction towards the sky, a unit vector.
  struct Found {
    V3 p, d;
    float light;  // positive and finite
  };
  explicit Portals(std::span<const Found> found);

  bool any() const { return !portals_.empty(); }
  // True if there is a portal in front of p: only then are directions sampled there.
  bool any_in_front_of(const V3& p) const { return weight_in_front_of(p) > 0; }
  // Samples a direction at p by 64 uniform random bits. Returns nullopt if no portal is in front of p, or if
  // rounding leaves no direction that meets the portal's plane.
  std::optional<V3> sample(const V3& p, std::uint32_t x, std::uint32_t y) const;
  // The density of sample() at p for the direction d, per steradian
  float pdf(const V3& p, const V3& d) const;

  std::uint64_t bytes() const;

 private:
  struct Plane {
    int axis = 0;    // the plane is p[axis] = offset
    float side = 1;  // 1: the sky is where p[axis] is larger; -1: where it is smaller
    float offset = 0;

    bool is_in_front_of(const V3& p) const { return (offset - p[axis]) * side > 0; }
    // The distance from p along d to the plane; nullopt: p is behind it, or d leads away from it.
    std::optional<float> distance(const V3& p, const V3& d) const;
    V2 on_plane(const V3& p) const { return {p[(axis + 1) % 3], p[(axis + 2) % 3]}; }
  };
  struct Portal {
    Plane plane;
    LearnedRectangle places;
    float weight = 0;  // a portal is chosen with probability weight / (sum over the portals in front of p)
  };
  struct Box;
  float weight_in_front_of(const V3& p) const;  // the sum over the portals in front of p
  static std::optional<Plane> best_plane(const Box& box, int face, std::span<const Found> rays);

  std::vector<Portal> portals_;
};

}  // namespace ls::render
