// Sparse storage of a grid's values: a table of nodes over the grid's box, nodes of 16^3 bricks, and bricks
// of 8^3 values each with a layer of the values that follow along each axis, so that a brick holds all that
// interpolation in it needs. Bricks and nodes of the same content are stored once, so that empty and constant
// space takes next to no memory, however large it is.
//
// All positions here are those of the grid's values, counted from 0 at the lowest corner of its box. The
// table begins `lead` values before the box.
#pragma once

#include <Imath/half.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <span>
#include <vector>

#include "core/base/error.h"
#include "worker/render/math/value_bounds.h"

namespace ls::render {

using Position = std::array<int, 3>;

inline constexpr int kBrickSide = 8;                // values of a brick along an axis, without the layer
inline constexpr int kBrickPitch = kBrickSide + 1;  // with it
inline constexpr int kNodeBricks = 16;              // bricks of a node along an axis
inline constexpr int kNodeSide = kNodeBricks * kBrickSide;  // values of a node along an axis
inline constexpr std::size_t kBrickValues = std::size_t{kBrickPitch} * kBrickPitch * kBrickPitch;
inline constexpr std::size_t kLeafValues = std::size_t{kBrickSide} * kBrickSide * kBrickSide;
inline constexpr std::size_t kNodeEntries = std::size_t{kNodeBricks} * kNodeBricks * kNodeBricks;

// Returns the size of the table of nodes over a box of `size` values.
inline Position table_size(const Position& size, const Position& lead) {
  Position n;
  for (std::size_t k = 0; k < 3; ++k) n[k] = (lead[k] + size[k] + kNodeSide - 1) / kNodeSide;
  return n;
}
inline std::size_t table_entries(const Position& size, const Position& lead) {
  const Position n = table_size(size, lead);
  return static_cast<std::size_t>(n[0]) * static_cast<std::size_t>(n[1]) * static_cast<std::size_t>(n[2]);
}
// Returns the index of a child of a node, or of a value of a leaf, at (x, y, z) in it. x varies fastest.
inline std::size_t in_node(int x, int y, int z) {
  return (static_cast<std::size_t>(z) * kNodeBricks + static_cast<std::size_t>(y)) * kNodeBricks +
         static_cast<std::size_t>(x);
}
inline std::size_t in_leaf(int x, int y, int z) {
  return (static_cast<std::size_t>(z) * kBrickSide + static_cast<std::size_t>(y)) * kBrickSide +
         static_cast<std::size_t>(x);
}
inline std::size_t in_brick(int x, int y, int z) {
  return (static_cast<std::size_t>(z) * kBrickPitch + static_cast<std::size_t>(y)) * kBrickPitch +
         static_cast<std::size_t>(x);
}

// Values as files hold them, of which bricks are made: a table over the box whose entries are constants or
// numbers of nodes; 16^3 entries a node, which are constants or numbers of leaves; leaves of 8^3 values for
// each channel, one channel after the other. Values outside of the box are 0, unless they are part of a
// constant entry that the box touches.
class VoxelTree {
 public:
  static constexpr std::uint32_t kConstant = std::uint32_t{1} << 31;  // set in entries that are constants

  Position size{}, lead{};  // lead: 0 to kNodeSide - 1
  int channels = 1;
  std::vector<std::uint32_t> table, nodes;
  std::vector<float> constants;  // `channels` for each constant
  std::vector<float> leaves;

  // Returns the entry for a constant, which has `channels` values.
  std::uint32_t constant(const float* values);

 private:
  std::map<std::array<std::uint32_t, 3>, std::uint32_t> known_;  // entries of constants, by their bits
};

// Bricks of one channel, in memory of their own or of another owner. Values are float32 or, if all of them
// are exact in 16 bits, halves; the other span is empty. Node 0 holds nothing but brick 0, all values of
// which are 0.
struct BrickTables {
  std::span<const std::uint32_t> table, nodes;
  std::span<const float> floats;
  std::span<const std::uint16_t> halves;

  std::size_t brick_count() const { return (floats.size() + halves.size()) / kBrickValues; }
  std::size_t bytes() const {
    return (table.size() + nodes.size()) * sizeof(std::uint32_t) + floats.size_bytes() + halves.size_bytes();
  }
};
struct OwnBricks {
  std::vector<std::uint32_t> table, nodes;
  std::vector<float> floats;
  std::vector<std::uint16_t> halves;

  operator BrickTables() const { return {table, nodes, floats, halves}; }
};

inline float as_float(float v) { return v; }
inline float as_float(std::uint16_t half) {
  Imath::half h;
  h.setBits(half);
  return h;
}

// Returns the tree of a dense grid with one channel, x fastest.
VoxelTree tree_of(const Position& size, std::span<const float> values);

// True if each value of a channel is exact as a half.
bool all_halves(const VoxelTree& tree, int channel);

// Makes the bricks of one channel, of halves if all_halves(). Equal trees give equal bricks. Fails with
// resource_exhausted if they take more than max_bytes.
Result<OwnBricks> make_bricks(const VoxelTree& tree, int channel, std::uint64_t max_bytes);
// The same, but frees the memory of leaves while it makes their bricks.
Result<OwnBricks> make_last_bricks(VoxelTree&& tree, int channel, std::uint64_t max_bytes);

class Bricks {
 public:
  // The numbers in the tables must be sound (sound()). `owner` keeps them in memory.
  Bricks(const Position& size, const Position& lead, const BrickTables& tables,
         std::shared_ptr<const void> owner);
  Bricks(const Position& size, const Position& lead, OwnBricks bricks);

  // True if a table over this box refers to nodes that exist, nodes to bricks that exist, and node 0 and
  // brick 0 are empty. No values but those of brick 0 are read.
  static bool sound(const Position& size, const Position& lead, const BrickTables& tables);

  const Position& size() const { return size_; }
  std::size_t bytes() const { return tables_.bytes(); }
  std::uint64_t brick_count() const { return tables_.brick_count(); }
  bool halves() const { return halves_ != nullptr; }

  float at(int x, int y, int z) const { return value(place(x, y, z)); }
  // Returns the values at a position and those that follow it along each axis; x varies fastest. What follows
  // the last position is some finite number.
  std::array<float, 8> corners(int x, int y, int z) const {
    const std::size_t i = place(x, y, z);
    return halves_ ? corners(halves_ + i) : corners(floats_ + i);
  }
  // The functions below are for the values from position a to position b, both included. They take time for
  // what is not constant. The sum is rounded as if values were added along x, then y, then z, in boxes of up
  // to kOrderedSide values along each axis.
  static constexpr int kOrderedSide = 32;
  ValueSums sums(const Position& a, const Position& b) const;
  std::uint64_t count_above(float limit, const Position& a, const Position& b) const;

  float largest() const;
  bool operator==(const Bricks& other) const;
  // Returns the bricks of the means of three grids with the same box.
  static Bricks mean(const Bricks& a, const Bricks& b, const Bricks& c);
  // Returns all values of the box, x fastest.
  std::vector<float> dense() const;

 private:
  // Returns the number of the brick at these coordinates, which count bricks from the beginning of the table.
  std::uint32_t number(int x, int y, int z) const {
    const std::uint32_t node =
        table_[(static_cast<std::size_t>(z >> 4) * row_[1] + static_cast<std::size_t>(y >> 4)) * row_[0] +
               static_cast<std::size_t>(x >> 4)];
    return nodes_[node * kNodeEntries + in_node(x & 15, y & 15, z & 15)];
  }
  // Returns the index of the value at a position among those of all bricks.
  std::size_t place(int x, int y, int z) const {
    const auto i = static_cast<unsigned>(x + lead_[0]), j = static_cast<unsigned>(y + lead_[1]),
               k = static_cast<unsigned>(z + lead_[2]);
    const std::size_t node = table_[((k >> 7) * row_[1] + (j >> 7)) * row_[0] + (i >> 7)];
    const std::size_t brick =
        nodes_[node * kNodeEntries + ((k >> 3 & 15) << 8 | (j >> 3 & 15) << 4 | (i >> 3 & 15))];
    return brick * kBrickValues + ((k & 7) * kBrickPitch + (j & 7)) * kBrickPitch + (i & 7);
  }
  float value(std::size_t i) const { return halves_ ? as_float(halves_[i]) : floats_[i]; }
  template <class T>
  static std::array<float, 8> corners(const T* v) {
    constexpr std::size_t y = kBrickPitch, z = std::size_t{kBrickPitch} * kBrickPitch;
    return {as_float(v[0]), as_float(v[1]),     as_float(v[y]),     as_float(v[y + 1]),
            as_float(v[z]), as_float(v[z + 1]), as_float(v[z + y]), as_float(v[z + y + 1])};
  }
  template <class Visit>
  void visit(const Position& a, const Position& b, const Visit& visit) const;
  double ordered_sum(const Position& a, const Position& b) const;

  const std::uint32_t *table_ = nullptr, *nodes_ = nullptr;
  const float* floats_ = nullptr;  // or halves
  const std::uint16_t* halves_ = nullptr;
  std::array<std::size_t, 2> row_{};  // of the table: its size along x and y
  Position lead_{}, size_{};
  std::vector<bool> same_in_brick_, same_in_node_;  // by number: true if all values are the same
  BrickTables tables_;
  std::shared_ptr<const void> owner_;
};

}  // namespace ls::render
