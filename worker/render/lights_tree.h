// A tree of many lights, by which the ones that matter at a point are found (Conty Estevez and Kulla 2018,
// "Importance Sampling of Many Lights with Adaptive Tree Splitting").
//
// A node knows a ball about its lights, a cone about the directions they face and how far from those they
// shine, and the sum of their intensities. At a point x on a surface of normal n its importance is
//
//   intensity max(cos a, 1/16) cos i / max(d, r)^2,    0 if a exceeds what the lights reach,
//
// d the distance to the ball's centre and r its radius; a the angle between the cone's axis and the way to x,
// less the cone's spread and the ball's angular radius as seen from x; i the angle between n, or its
// opposite, and the way to the centre, less that radius; in a medium there is no cos i. A light is found from
// the root by choosing among children in proportion to their importance.
//
// Random words are split, not real numbers: of the words that come to a node each child gets a whole number,
// and the probability of a light is the number of words that come to it, exactly. All is plain float32 and
// float64 arithmetic without library functions but square roots: the same on every machine.
#pragma once

#include <cstdint>
#include <vector>

#include "worker/render/math.h"

namespace ls::render {

struct LightBounds {
  V3 low, high;           // a box about the light
  V3 axis{0, 0, 1};       // its directions lie within `cos_spread` of this,
  float cos_spread = -1;  // -1: anywhere
  float cos_reach = 0;    // and it shines as far from them as this
  double intensity = 0;   // per steradian, where it is largest; positive and finite
};

class LightTree {
 public:
  LightTree() = default;
  // At least one light, kMaxLights at most.
  static LightTree build(const std::vector<LightBounds>& lights);
  static constexpr std::size_t kMaxLights = std::size_t{1} << 24;

  struct Found {
    std::uint32_t light = 0;  // index into what the tree was built from
    std::uint64_t words = 0;  // how many of all words come to it; at least 1
  };
  // Of `words` words (2^32 at most) the one numbered `word`. n: the normal at x; zero in a medium.
  Found find(std::uint64_t word, std::uint64_t words, const V3& x, const V3& n) const;
  std::uint64_t words_of(std::uint32_t light, std::uint64_t words, const V3& x, const V3& n) const;

  bool empty() const { return nodes_.empty(); }
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
    std::uint32_t right = 0;  // the left child follows its parent; 0: a leaf
    std::uint32_t light = 0;
  };
  class Builder;
  static float importance(const Node& node, const V3& x, const V3& n);
  // How many of the words of this inner node its left child gets.
  std::uint64_t left_share(std::uint32_t node, std::uint64_t words, const V3& x, const V3& n) const;

  std::vector<Node> nodes_;
  std::vector<std::uint64_t> trails_;  // of each light: bit k is set where its path turns right at depth k
};

}  // namespace ls::render
