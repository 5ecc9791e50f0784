// Chooses lights by random words (32 random bits): by one table for all places, or by tables that are learned
// for each place (LocalLights).
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "worker/render/math/math.h"

namespace ls::render {

// A light, and the probability with which it was chosen
struct DrawnLight {
  std::uint32_t light = 0;
  float probability = 0;
};

// A table chooses one of several lights by a random word of 32 bits. Light i is chosen by the words from
// last[i - 1] + 1 to last[i], so its probability is exactly their share of the 2^32 words.
//
// append_light_table() adds to `last` a table of lights with these probabilities, whose sum is 1. Each must
// be at least 2^-31, and each light gets at least one word.
inline void append_light_table(std::span<const double> probabilities, std::vector<std::uint32_t>& last) {
  double sum = 0;
  std::uint64_t before = 0;
  for (std::size_t i = 0; i < probabilities.size(); ++i) {
    sum += probabilities[i];
    const bool is_last = i + 1 == probabilities.size();
    const std::uint64_t edge =
        is_last ? std::uint64_t{1} << 32
                : std::max(before + 1, static_cast<std::uint64_t>(std::llround(sum * 0x1p32)));
    last.push_back(static_cast<std::uint32_t>(edge - 1));
    before = edge;
  }
}

inline std::uint32_t light_of_word(std::span<const std::uint32_t> last, std::uint32_t word) {
  return static_cast<std::uint32_t>(std::lower_bound(last.begin(), last.end() - 1, word) - last.begin());
}

inline float probability_of_words(std::uint64_t words) {
  return static_cast<float>(static_cast<double>(words) * 0x1p-32);
}

inline float probability_in_table(std::span<const std::uint32_t> last, std::uint32_t light) {
  const std::uint64_t before = light == 0 ? 0 : std::uint64_t{last[light - 1]} + 1;
  return probability_of_words(std::uint64_t{last[light]} + 1 - before);
}

// Places at which learning paths (camera paths traced before the first sample) were scattered, and the light
// that reached each place.
struct LightVisits {
  struct Place {
    V3 p, n;  // n: the normal of its surface; 0 in a medium
  };
  std::vector<Place> places;
  std::vector<float> values;  // for each place, the share of each light in the arriving light

  // Adds a place, unless no light reaches it or a number is not finite. `found` is the light that arrives
  // from each light source; no value is negative.
  void add(const V3& p, const V3& n, std::span<const float> found);
  void add(const LightVisits& more);
};

// Chooses a light for next-event estimation with probabilities that depend on the place. They are learned
// from the light that reached nearby places: in the shade of a wall the sun is rarely chosen.
//
// At the vertices of learning camera paths, one shadow ray per light measures the light that arrives. The
// vertices are sorted into seven classes: six by the axis direction that their normal is closest to, one for
// media. For each class a k-d tree, split at the median of the longest axis, has leaves with few vertices.
// Let v_i be the share of light i in the light that arrives at a vertex of a leaf. Next-event estimation
// with one light, chosen with the probabilities p_i, has the least variance for p_i proportional to the
// square root of the mean of v_i^2 (Vevoda, Kondapaneni and Krivanek 2018, "Bayesian online regression for
// adaptive direct illumination sampling", equation 9). These probabilities are mixed with those of the table
// of all lights, which has the weight 1/4. So no light's probability is less than a quarter of that in the
// table.
class LocalLights {
 public:
  static constexpr std::size_t kMostLights = 64;

  // Learns from visits of at least one place; `table`: the probability of each light in the table of all
  // lights.
  LocalLights(const LightVisits& visits, std::span<const double> table);

  // True if places in media were visited. If not, lights can be chosen only for places on surfaces.
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
    // For an inner node: the index of the child below the plane; the child above has the next index. For a
    // leaf: the index in tables_ at which its table begins.
    std::uint32_t next = 0;
    std::uint8_t axis = kLeaf;  // axis that the plane is perpendicular to; kLeaf: a leaf
  };
  struct Builder;

  std::span<const std::uint32_t> table_at(const V3& p, const V3& n) const;

  std::size_t lights_;
  std::vector<Node> nodes_;  // the first seven are the roots, one for each class
  std::vector<std::uint32_t> tables_;
  bool in_media_ = false;
};

}  // namespace ls::render
