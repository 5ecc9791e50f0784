// Portals: the openings through which the light of the sky enters a scene.
//
// Next-event estimation samples an environment map by its brightness alone. In a room that the sky lights
// through a window, nearly all of these directions end at the walls. So camera paths are traced before the
// first sample, and the rays along which they found the sky tell where it enters: for each face of a box
// around the scene, a plane parallel to it is chosen on which the rays that leave through this face are
// closest together. That is the plane of the window, or one near it. On this plane the places of the rays are
// learned as a density; next-event estimation samples a place and thus a direction.
//
// Portals that are drawn by hand are common (Bitterli, Novak and Jarosz 2015, "Portal-Masked Environment Map
// Sampling"); these are found, need not cover all openings, and are one part of a mixture with the sampling
// of the map (SkyLight).
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
  // Samples a direction at p by 64 uniform random bits. nullopt only if none is representable.
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
    float weight = 0;  // a portal is chosen with this over the sum of the weights of those in front of p
  };
  struct Box;
  float weight_in_front_of(const V3& p) const;  // the sum over the portals in front of p
  static std::optional<Plane> best_plane(const Box& box, int face, std::span<const Found> rays);

  std::vector<Portal> portals_;
};

}  // namespace ls::render
