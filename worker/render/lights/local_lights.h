// The choice of a light for a place, learned from the light that reaches places like it. In the
// shade of a wall the sun is hardly chosen, however bright it is.
//
// Camera paths visit places of the scene and look for every light there, by one shadow ray each. The visits
// are divided by the side to which the surface faces (those in media apart), and then by planes across their
// longest extent (a k-d tree), until each cell has few. Where the light of i has the values v_i (relative to
// that of all lights together), the variance of next-event estimation with one light, chosen with the
// probabilities p_i, is least for p_i proportional to the square root of the mean of v_i^2 (Vevoda,
// Kondapaneni and Krivanek 2018, "Bayesian online regression for adaptive direct illumination sampling",
// equation 9). A quarter of the choices is made by the table of all lights, so no light is chosen less than a
// quarter as often as by that.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "worker/render/lights/light_table.h"
#include "worker/render/math/math.h"

namespace ls::render {

// Places, and the light that reached each.
struct LightVisits {
  struct Place {
    V3 p, n;  // n: the normal of its surface; 0 in a medium
  };
  std::vector<Place> places;
  std::vector<float> values;  // those of all lights, for each place

  // Adds a place unless it is dark, or a number is not finite. `found`: the light of each; not negative.
  void add(const V3& p, const V3& n, std::span<const float> found);
  void add(const LightVisits& more);
};

class LocalLights {
 public:
  static constexpr std::size_t kMostLights = 64;

  // Learns from visits of at least one place; `table`: the probability of each light in the table of all
  // lights.
  LocalLights(const LightVisits& visits, std::span<const double> table);

  // True if places in media were visited. Else lights can be chosen for places on surfaces alone.
  bool in_media() const { return in_media_; }
  // Chooses a light for the point p on a surface of normal n, or in a medium (n = 0), by a random word.
  DrawnLight draw(std::uint32_t word, const V3& p, const V3& n) const;
  // The probability with which draw() chooses this light.
  float probability(std::uint32_t light, const V3& p, const V3& n) const;

  std::uint64_t bytes() const;

 private:
  static constexpr std::uint8_t kLeaf = 3;
  struct Node {
    float plane = 0;
    std::uint32_t next =
        0;  // the node below the plane, before the one above it; of a leaf, where its table begins
    std::uint8_t axis = kLeaf;  // of the plane
  };
  struct Builder;

  std::span<const std::uint32_t> table_at(const V3& p, const V3& n) const;

  std::size_t lights_;
  std::vector<Node> nodes_;  // first those of the six sides, and of media
  std::vector<std::uint32_t> tables_;
  bool in_media_ = false;
};

}  // namespace ls::render
