// Reads the voxels of a grid that is a tree of leaves of 8^3 voxels in nodes of 16^3 leaves, as OpenVDB's and
// NanoVDB's are: checks the values, and keeps leaves and constant regions as they are, without filling space.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <new>
#include <optional>
#include <string>

#include "worker/render/bricks/bricks.h"
#include "worker/render/media/vdb_reply.h"
#include "worker/render/vdb/nvdb.h"

namespace ls::render {

// Reads the voxels from `lo` to before `end`, which set_box() has given to `out`. A Source has
//   std::optional<Node> node(const Coord& origin, Value& all);   the node that begins at a multiple of
//     kNodeSide, or nullopt if all of its voxels are `all`;
//   std::optional<Leaf> leaf(Node, int x, int y, int z, Value& all) const;  child of a node, likewise;
//   Value voxel(Leaf, int x, int y, int z) const.
template <class Source>
class TreeReader {
 public:
  TreeReader(Source& source, const Coord& lo, const Coord& end, std::uint64_t max_bytes, VdbVoxels& out)
      : source_(source), lo_(lo), end_(end), max_bytes_(max_bytes), out_(out), tree_(out.tree) {}

  void read() {
    const Position n = table_size(tree_.size, tree_.lead);
    need(0);
    tree_.table.reserve(table_entries(tree_.size, tree_.lead));
    Coord begin;
    for (std::size_t k = 0; k < 3; ++k) begin[k] = lo_[k] - tree_.lead[k];
    for (int z = 0; z < n[2]; ++z)
      for (int y = 0; y < n[1]; ++y)
        for (int x = 0; x < n[0]; ++x)
          tree_.table.push_back(
              entry({begin[0] + x * kNodeSide, begin[1] + y * kNodeSide, begin[2] + z * kNodeSide}));
  }

 private:
  std::uint32_t entry(const Coord& origin) {
    Value all{};
    const auto node = source_.node(origin, all);
    if (!node) return constant(origin, kNodeSide, all);
    const std::size_t first = tree_.nodes.size();
    need(kNodeEntries * sizeof(std::uint32_t));
    tree_.nodes.resize(first + kNodeEntries);
    for (int z = 0; z < kNodeBricks; ++z)
      for (int y = 0; y < kNodeBricks; ++y)
        for (int x = 0; x < kNodeBricks; ++x) {
          const Coord at{origin[0] + x * kBrickSide, origin[1] + y * kBrickSide, origin[2] + z * kBrickSide};
          const auto leaf = source_.leaf(*node, x, y, z, all);
          tree_.nodes[first + in_node(x, y, z)] =
              leaf && meets(at, kBrickSide) ? leaf_entry(*leaf, at) : constant(at, kBrickSide, all);
        }
    return static_cast<std::uint32_t>(first / kNodeEntries);
  }

  template <class Leaf>
  std::uint32_t leaf_entry(const Leaf& leaf, const Coord& origin) {
    const auto channels = static_cast<std::size_t>(tree_.channels);
    std::array<float, 3 * kLeafValues> all{};
    for (int z = 0; z < kBrickSide; ++z)
      for (int y = 0; y < kBrickSide; ++y)
        for (int x = 0; x < kBrickSide; ++x) {
          const Coord c{origin[0] + x, origin[1] + y, origin[2] + z};
          if (!meets(c, 1)) continue;
          const Value v = usable(c, source_.voxel(leaf, x, y, z), 1);
          for (std::size_t k = 0; k < channels; ++k) all[k * kLeafValues + in_leaf(x, y, z)] = v[k];
        }
    if (const auto same = same_values(all, channels)) return tree_.constant(same->data());
    need(channels * kLeafValues * sizeof(float));
    try {
      tree_.leaves.insert(tree_.leaves.end(), all.begin(),
                          all.begin() + static_cast<std::ptrdiff_t>(channels * kLeafValues));
    } catch (const std::bad_alloc&) {
      throw Refused{2, "grid '" + out_.name + "' needs more memory than the renderer has left of its limit"};
    }
    return static_cast<std::uint32_t>(tree_.leaves.size() / (channels * kLeafValues) - 1);
  }
  static std::optional<Value> same_values(const std::array<float, 3 * kLeafValues>& all,
                                          std::size_t channels) {
    Value one{};
    for (std::size_t k = 0; k < channels; ++k) {
      one[k] = all[k * kLeafValues];
      for (std::size_t i = 1; i < kLeafValues; ++i)
        if (std::bit_cast<std::uint32_t>(all[k * kLeafValues + i]) != std::bit_cast<std::uint32_t>(one[k]))
          return std::nullopt;
    }
    return one;
  }

  std::uint32_t constant(const Coord& origin, int side, const Value& value) {
    if (!meets(origin, side)) return tree_.constant(Value{}.data());
    Coord first;
    std::uint64_t count = 1;
    for (std::size_t k = 0; k < 3; ++k) {
      first[k] = std::max(origin[k], lo_[k]);
      count *= static_cast<std::uint64_t>(std::min(origin[k] + side, end_[k]) - first[k]);
    }
    return tree_.constant(usable(first, value, count).data());
  }

  // Returns the value of `count` voxels, the first of which is at c, with 0 in place of what is negative.
  Value usable(const Coord& c, Value value, std::uint64_t count) {
    for (std::size_t k = 0; k < static_cast<std::size_t>(tree_.channels); ++k) {
      if (!std::isfinite(value[k]))
        throw Refused{1, "voxel (" + std::to_string(c[0]) + ", " + std::to_string(c[1]) + ", " +
                             std::to_string(c[2]) + ") of grid '" + out_.name + "' is not a finite number"};
      if (!(value[k] < 0)) continue;
      value[k] = 0;
      out_.shape.negatives += count;
    }
    return value;
  }

  // Refuses the grid if it takes more than max_bytes with so many more.
  void need(std::uint64_t bytes) {
    const std::uint64_t stored =
        sizeof(float) * (tree_.leaves.size() + tree_.constants.size()) +
        sizeof(std::uint32_t) * (tree_.nodes.size() + table_entries(tree_.size, tree_.lead));
    if (stored + bytes > max_bytes_) throw too_large(out_, max_bytes_);
  }
  bool meets(const Coord& c, int side) const {
    for (std::size_t k = 0; k < 3; ++k)
      if (c[k] >= end_[k] || c[k] + side <= lo_[k]) return false;
    return true;
  }

  Source& source_;
  const Coord lo_, end_;
  const std::uint64_t max_bytes_;
  VdbVoxels& out_;
  VoxelTree& tree_;
};

}  // namespace ls::render
