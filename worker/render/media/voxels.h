// The values of a grid at its nodes, which are positions of whole numbers from (0, 0, 0) on. They are stored
// as one array or, where that saves memory, as bricks (bricks.h); a lookup gives the same either way.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "worker/render/math/value_bounds.h"

namespace ls::render {

class Bricks;
using Position = std::array<int, 3>;

class Voxels {
 public:
  Voxels() = default;  // no nodes
  // One value per node, x fastest.
  Voxels(const Position& size, std::vector<float> values);
  explicit Voxels(Bricks bricks);
  // The same, stored in the given way even where the other one is better.
  static Voxels as_array(const Position& size, std::vector<float> values);
  static Voxels as_bricks(Bricks bricks);

  const Position& size() const { return size_; }
  // True if the values are one array.
  bool dense() const { return array_ != nullptr; }

  // Returns the values of a node and of those that follow it along each axis; x varies fastest. What follows
  // the last node is some finite number. The first function is for arrays, the second for bricks.
  std::array<float, 8> corners(int x, int y, int z) const {
    const float* v = node(x, y, z);
    const std::size_t dx = steps_[0], dy = steps_[1], dz = steps_[2];
    return {v[0], v[dx], v[dy], v[dy + dx], v[dz], v[dz + dx], v[dz + dy], v[dz + dy + dx]};
  }
  std::array<float, 8> corners_in_bricks(int x, int y, int z) const;

  float at(int x, int y, int z) const { return dense() ? *node(x, y, z) : in_bricks(x, y, z); }

  // These two are for the nodes from a to b, both included; no nodes if b is below a. `limit` is at least 0.
  ValueSums sums(const Position& a, const Position& b) const;
  std::uint64_t count_above(float limit, const Position& a, const Position& b) const;
  float largest() const;

  bool halves() const;  // true if values are stored as halves
  // Number of nodes, and of values that are stored for them
  std::uint64_t count() const;
  std::uint64_t stored() const;
  std::uint64_t bytes() const;

  // True if the values are the same and stored in the same way, as equal values are.
  bool operator==(const Voxels& other) const;
  // Returns the means of the values of three grids of the same size.
  static Voxels mean(const Voxels& a, const Voxels& b, const Voxels& c);

 private:
  const float* node(int x, int y, int z) const {
    return array_ + (static_cast<std::size_t>(z) * size_[1] + y) * size_[0] + x;
  }
  float in_bricks(int x, int y, int z) const;

  Position size_{};
  std::array<std::size_t, 3> steps_{};  // of the array, from a node to those that follow it
  const float* array_ = nullptr;
  std::shared_ptr<const std::vector<float>> values_;
  std::shared_ptr<const Bricks> bricks_;
};

}  // namespace ls::render
