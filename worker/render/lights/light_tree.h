// A tree of many lights, for sampling those that matter at a point (Conty Estevez and Kulla 2018, "Importance
// Sampling of Many Lights with Adaptive Tree Splitting").
//
// A node stores a ball around its lights, a cone around their emission directions, how far they emit beyond
// that cone, and the sum of their intensities. At a point x on a surface of normal n its importance is
//
//   intensity max(cos a, 1/16) cos i / max(d, r)^2,    0 if a exceeds the emission range,
//
// with d the distance to the ball's centre and r its radius; a the angle between the cone's axis and the
// direction to x, minus the cone's spread and the ball's angular radius as seen from x; i the angle between
// n, or its opposite, and the direction to the centre, minus the same angular radius. In a medium the factor
// cos i is left out. A light is sampled by descending from the root, choosing among children in proportion to
// their importance.
//
// Lights are chosen by random words (integers) instead of real numbers. The root has all 32-bit words, or as
// many as the caller gives it, and each child gets a whole number of its parent's words. So the probability
// of a light is exactly the number of words that reach it over the number of all words. All arithmetic is
// plain float32 and float64 without library functions other than square roots, so the results are the same on
// every machine.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "worker/render/math/math.h"

namespace ls::render {

struct LightBounds {
  V3 low, high;           // bounding box of the light
  V3 axis{0, 0, 1};       // axis of a cone that contains the normals of its emitting points
  float cos_spread = -1;  // cosine of that cone's half angle; -1: all directions
  float cos_reach = 0;    // cosine of the largest angle between a normal and the emitted light
  // Luminous flux per steradian along a normal, with textures averaged; positive and finite
  double intensity = 0;
};

class LightTree {
 public:
  LightTree() = default;
  // Builds the tree of `lights`, of which there must be 1 to kMaxLights.
  static LightTree build(const std::vector<LightBounds>& lights);
  static constexpr std::size_t kMaxLights = std::size_t{1} << 24;

  struct Found {
    std::uint32_t light = 0;  // index into the vector that the tree was built from
    std::uint64_t words = 0;  // number of words that reach this light; at least 1
  };
  // Returns the light that word number `word` of `words` reaches when lights are sampled at the point x.
  // `words` is at most 2^32. n is the surface normal at x, or zero if x is in a medium.
  Found find(std::uint64_t word, std::uint64_t words, const V3& x, const V3& n) const;
  std::uint64_t words_of(std::uint32_t light, std::uint64_t words, const V3& x, const V3& n) const;

  bool empty() const { return nodes_.empty(); }
  std::size_t lights() const { return trails_.size(); }
  std::uint64_t bytes() const {
    return nodes_.size() * sizeof(Node) + trails_.size() * sizeof(std::uint64_t);
  }

 private:
  struct Node {
    V3 center;
    float radius2 = 0;
    V3 axis;
    float cos_spread = -1, sin_spread = 0, cos_reach = 0;
    float intensity = 0;
    std::uint32_t right = 0;  // index of the right child; the left one directly follows its parent; 0: a leaf
    std::uint32_t light = 0;
  };
  class Builder;
  static float importance(const Node& node, const V3& x, const V3& n);
  // Returns how many of the `words` that reach the inner node `node` go to its left child.
  std::uint64_t left_share(std::uint32_t node, std::uint64_t words, const V3& x, const V3& n) const;

  std::vector<Node> nodes_;
  std::vector<std::uint64_t> trails_;  // for each light: bit k is set if its path turns right at depth k
};

}  // namespace ls::render
