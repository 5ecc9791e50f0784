// A probability density over a rectangle, learned from weighted points. The rectangle has side x side cells,
// and the density is constant in each cell.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "worker/render/math/math.h"

namespace ls::render {

class LearnedRectangle {
 public:
  LearnedRectangle() = default;  // not usable until another object is assigned to it
  explicit LearnedRectangle(std::size_t side) : side_(side) {}

  // Adds a point; a weight that is not positive and finite is ignored.
  void learn(V2 at, float weight);
  void add(const LearnedRectangle& other);  // adds the points that `other` has learned
  // Converts the points to a density; call once, after all points. The rectangle is the bounding box of the
  // points, enlarged on each side by the side of a cell and by `margin`. The integral of the density is 1 -
  // `outside_share`. A share of the density is uniform over the rectangle, for places with few or no points.
  void finish(float margin, double outside_share);

  bool empty() const { return last_.empty(); }
  float density(V2 at) const;                              // per unit area; 0 outside of the rectangle
  double outside_share() const { return outside_share_; }  // as given to finish(), rounded to 2^-32

  // Returns the place that `word` (32 uniform random bits) and the uniform numbers u choose. They choose no
  // place (nullopt) with the probability outside_share().
  std::optional<V2> sample(std::uint32_t word, V2 u) const;
  // Does the same with one random number less: u.y is v, and u.x is computed from the position of `word`
  // among the words that choose its cell.
  std::optional<V2> sample(std::uint32_t word, float v) const;

  std::uint64_t bytes() const { return density_.size() * sizeof(float) + last_.size() * sizeof(last_[0]); }

 private:
  struct Found {
    V2 at;
    float weight;
  };
  std::size_t cell_of(V2 at) const;
  std::size_t chosen(std::uint32_t word) const;
  V2 in_cell(std::size_t cell, V2 u) const;

  std::size_t side_ = 0;
  std::vector<Found> found_;  // the points learned; emptied by finish()
  V2 lo_{0, 0}, hi_{0, 0};    // corners of the rectangle
  std::vector<float> density_;
  std::vector<std::uint32_t> last_;  // for each cell, the last word that chooses it
  double outside_share_ = 0;
};

}  // namespace ls::render
