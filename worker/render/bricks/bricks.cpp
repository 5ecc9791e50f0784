#include "worker/render/bricks/bricks.h"

#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <map>
#include <unordered_map>
#include <utility>

namespace ls::render {
namespace {

std::uint32_t bits_of(float v) { return std::bit_cast<std::uint32_t>(v); }
std::uint32_t bits_of(std::uint32_t v) { return v; }
std::uint32_t bits_of(std::uint16_t v) { return v; }

// Arrays of `kLength` elements, each stored once.
template <class T, std::size_t kLength>
class Distinct {
 public:
  // Returns the number of `array`, and adds it if it is new.
  std::uint32_t number(const T* array) {
    const std::uint64_t hash = hash_of(array);
    const auto [first, last] = known_.equal_range(hash);
    for (auto i = first; i != last; ++i)
      if (std::memcmp(array, all.data() + i->second * kLength, kLength * sizeof(T)) == 0) return i->second;
    const auto next = static_cast<std::uint32_t>(all.size() / kLength);
    all.insert(all.end(), array, array + kLength);
    known_.emplace(hash, next);
    return next;
  }

  std::vector<T> all;

 private:
  static std::uint64_t hash_of(const T* array) {
    std::uint64_t hash = 0;
    for (std::size_t i = 0; i < kLength; ++i) {
      hash = (hash ^ bits_of(array[i])) * 0x9e37'79b9'7f4a'7c15;
      hash ^= hash >> 32;
    }
    return hash;
  }
  std::unordered_multimap<std::uint64_t, std::uint32_t> known_;
};

using Node = std::array<std::uint32_t, kNodeEntries>;

void store(float value, float& to) { to = value; }
void store(float value, std::uint16_t& to) { to = Imath::half(value).bits(); }
std::vector<float>& values_of(OwnBricks& bricks, float) { return bricks.floats; }
std::vector<std::uint16_t>& values_of(OwnBricks& bricks, std::uint16_t) { return bricks.halves; }

// Makes bricks of values of type T.
template <class T>
class Maker {
 public:
  // `leaves` are those of the tree if their memory may be freed, else null.
  Maker(const VoxelTree& tree, int channel, std::uint64_t max_bytes, std::vector<float>* leaves)
      : tree_(tree),
        leaves_(leaves),
        channel_(static_cast<std::size_t>(channel)),
        max_bytes_(max_bytes),
        table_(table_size(tree.size, tree.lead)) {}

  Result<OwnBricks> make() {
    OwnBricks out;
    bricks_.number(Values{}.data());
    nodes_.number(Node{}.data());
    // Bricks with a leaf are hardly ever equal to others.
    bricks_.all.reserve(std::min(bricks_with_leaves(), max_bytes_ / sizeof(Values)) * kBrickValues +
                        kBrickValues);
    out.table.reserve(tree_.table.size());
    for (int z = 0; z < table_[2]; ++z)
      for (int y = 0; y < table_[1]; ++y)
        for (int x = 0; x < table_[0]; ++x) {
          out.table.push_back(node(x, y, z));
          free_leaves(x, y, z);
          if (sizeof(T) * bricks_.all.size() +
                  sizeof(std::uint32_t) * (nodes_.all.size() + tree_.table.size()) >
              max_bytes_)
            return fail(Errc::resource_exhausted, "its bricks take too much memory");
        }
    out.nodes = std::move(nodes_.all);
    values_of(out, T{}) = std::move(bricks_.all);
    return out;
  }

 private:
  using Values = std::array<T, kBrickValues>;

  // Returns the tree's entry for the leaf at these coordinates, which count leaves from the beginning of the
  // table. Beyond its end the last leaves are repeated, as nothing there is ever looked up.
  std::uint32_t entry(int x, int y, int z) const {
    x = std::min(x, table_[0] * kNodeBricks - 1);
    y = std::min(y, table_[1] * kNodeBricks - 1);
    z = std::min(z, table_[2] * kNodeBricks - 1);
    const std::uint32_t top = tree_.table[at(x / kNodeBricks, y / kNodeBricks, z / kNodeBricks)];
    return top & VoxelTree::kConstant
               ? top
               : tree_.nodes[top * kNodeEntries + in_node(x % kNodeBricks, y % kNodeBricks, z % kNodeBricks)];
  }
  std::size_t at(int x, int y, int z) const {
    return (static_cast<std::size_t>(z) * static_cast<std::size_t>(table_[1]) + static_cast<std::size_t>(y)) *
               static_cast<std::size_t>(table_[0]) +
           static_cast<std::size_t>(x);
  }
  float constant(std::uint32_t entry) const {
    return tree_
        .constants[(entry & ~VoxelTree::kConstant) * static_cast<std::size_t>(tree_.channels) + channel_];
  }
  // The eight entries that the values of a brick come from, or those of a node: its own, and those that
  // follow.
  using Sources = std::array<std::uint32_t, 8>;
  Sources sources(int x, int y, int z) const {
    Sources s;
    for (int i = 0; i < 8; ++i)
      s[static_cast<std::size_t>(i)] = entry(x + (i & 1), y + (i >> 1 & 1), z + (i >> 2));
    return s;
  }
  Sources sources_of_node(int x, int y, int z) const {
    Sources s;
    for (int i = 0; i < 8; ++i)
      s[static_cast<std::size_t>(i)] =
          tree_.table[at(std::min(x + (i & 1), table_[0] - 1), std::min(y + (i >> 1 & 1), table_[1] - 1),
                         std::min(z + (i >> 2), table_[2] - 1))];
    return s;
  }
  static bool constants(const Sources& s) {
    return std::ranges::all_of(s, [](std::uint32_t e) { return (e & VoxelTree::kConstant) != 0; });
  }

  // Parts that are made of constants alone, by the bits of these. Neighbours are mostly of the same
  // constants.
  class Known {
   public:
    // Returns the number for `from`, which make() gives the first time.
    template <class Make>
    std::uint32_t number(const Sources& from, const Make& make) {
      if (from == last_) return last_number_;
      last_ = from;
      const auto [known, is_new] = numbers_.try_emplace(from, 0);
      if (is_new) known->second = make();
      return last_number_ = known->second;
    }

   private:
    std::map<Sources, std::uint32_t> numbers_;
    Sources last_{};  // no number belongs to it yet: entries of constants are not 0
    std::uint32_t last_number_ = 0;
  };

  std::uint32_t node(int x, int y, int z) {
    const auto make = [&] {
      Node all;
      for (int k = 0; k < kNodeBricks; ++k)
        for (int j = 0; j < kNodeBricks; ++j)
          for (int i = 0; i < kNodeBricks; ++i)
            all[in_node(i, j, k)] = brick(x * kNodeBricks + i, y * kNodeBricks + j, z * kNodeBricks + k);
      return nodes_.number(all.data());
    };
    const Sources from = sources_of_node(x, y, z);
    return constants(from) ? known_nodes_.number(from, make) : make();
  }

  std::uint32_t brick(int x, int y, int z) {
    const Sources from = sources(x, y, z);
    const auto make = [&] {
      Values all;
      for (int i = 0; i < 8; ++i) copy(from[static_cast<std::size_t>(i)], i & 1, i >> 1 & 1, i >> 2, all);
      return bricks_.number(all.data());
    };
    return constants(from) ? known_bricks_.number(from, make) : make();
  }
  // Copies to a brick what it has of the source that follows it along the axes whose flag is 1.
  void copy(std::uint32_t source, int dx, int dy, int dz, Values& to) const {
    const bool same = source & VoxelTree::kConstant;
    const float value = same ? constant(source) : 0;
    const float* leaf =
        same ? nullptr
             : tree_.leaves.data() +
                   (source * static_cast<std::size_t>(tree_.channels) + channel_) * kLeafValues;
    const auto count = [](int d) { return d ? 1 : kBrickSide; };
    for (int z = 0; z < count(dz); ++z)
      for (int y = 0; y < count(dy); ++y)
        for (int x = 0; x < count(dx); ++x)
          store(same ? value : leaf[in_leaf(x, y, z)],
                to[in_brick(x + dx * kBrickSide, y + dy * kBrickSide, z + dz * kBrickSide)]);
  }

  // Gives the pages of a node's leaves back, unless they may be needed again. Bricks are made in the order of
  // the table, and have values of their own node and of those that follow it.
  void free_leaves(int x, int y, int z) {
    const std::uint32_t top = tree_.table[at(x, y, z)];
    if (!leaves_ || top & VoxelTree::kConstant) return;
    std::size_t first = leaves_->size(), last = 0;
    for (std::size_t i = 0; i < kNodeEntries; ++i) {
      const std::uint32_t leaf = tree_.nodes[top * kNodeEntries + i];
      if (leaf & VoxelTree::kConstant) continue;
      const std::size_t values = static_cast<std::size_t>(tree_.channels) * kLeafValues;
      first = std::min(first, leaf * values);
      last = std::max(last, (leaf + 1) * values);
    }
    if (first >= last) return;
    const auto page = static_cast<std::uintptr_t>(::sysconf(_SC_PAGESIZE));
    const auto begin = (reinterpret_cast<std::uintptr_t>(leaves_->data() + first) + page - 1) / page * page,
               end = reinterpret_cast<std::uintptr_t>(leaves_->data() + last) / page * page;
    if (begin < end) ::madvise(reinterpret_cast<void*>(begin), end - begin, MADV_DONTNEED);
  }

  std::uint64_t bricks_with_leaves() const {
    std::uint64_t n = 0;
    for (int z = 0; z < table_[2]; ++z)
      for (int y = 0; y < table_[1]; ++y)
        for (int x = 0; x < table_[0]; ++x) {
          if (constants(sources_of_node(x, y, z))) continue;
          for (int b = 0; b < static_cast<int>(kNodeEntries); ++b)
            n += !constants(sources(x * kNodeBricks + (b & 15), y * kNodeBricks + (b >> 4 & 15),
                                    z * kNodeBricks + (b >> 8)));
        }
    return n;
  }

  const VoxelTree& tree_;
  std::vector<float>* const leaves_;
  const std::size_t channel_;
  const std::uint64_t max_bytes_;
  const Position table_;
  Distinct<T, kBrickValues> bricks_;
  Distinct<std::uint32_t, kNodeEntries> nodes_;
  Known known_bricks_, known_nodes_;
};

}  // namespace

std::uint32_t VoxelTree::constant(const float* values) {
  const auto n = static_cast<std::size_t>(channels);
  std::array<std::uint32_t, 3> bits{};
  std::transform(values, values + n, bits.begin(), [](float v) { return bits_of(v); });
  const auto [known, is_new] =
      known_.try_emplace(bits, kConstant | static_cast<std::uint32_t>(constants.size() / n));
  if (is_new) constants.insert(constants.end(), values, values + n);
  return known->second;
}

VoxelTree tree_of(const Position& size, std::span<const float> values) {
  VoxelTree tree;
  tree.size = size;
  const Position n = table_size(size, tree.lead);
  const auto value = [&](int x, int y, int z) {
    return x < size[0] && y < size[1] && z < size[2]
               ? values[(static_cast<std::size_t>(z) * static_cast<std::size_t>(size[1]) +
                         static_cast<std::size_t>(y)) *
                            static_cast<std::size_t>(size[0]) +
                        static_cast<std::size_t>(x)]
               : 0;
  };
  const auto leaf = [&](int x0, int y0, int z0) {
    std::array<float, kLeafValues> all;
    for (int z = 0; z < kBrickSide; ++z)
      for (int y = 0; y < kBrickSide; ++y)
        for (int x = 0; x < kBrickSide; ++x) all[in_leaf(x, y, z)] = value(x0 + x, y0 + y, z0 + z);
    if (std::ranges::all_of(all, [&](float v) { return bits_of(v) == bits_of(all[0]); }))
      return tree.constant(all.data());
    tree.leaves.insert(tree.leaves.end(), all.begin(), all.end());
    return static_cast<std::uint32_t>(tree.leaves.size() / kLeafValues - 1);
  };
  for (int z = 0; z < n[2]; ++z)
    for (int y = 0; y < n[1]; ++y)
      for (int x = 0; x < n[0]; ++x) {
        tree.table.push_back(static_cast<std::uint32_t>(tree.nodes.size() / kNodeEntries));
        for (int k = 0; k < kNodeBricks; ++k)
          for (int j = 0; j < kNodeBricks; ++j)
            for (int i = 0; i < kNodeBricks; ++i)
              tree.nodes.push_back(leaf(x * kNodeSide + i * kBrickSide, y * kNodeSide + j * kBrickSide,
                                        z * kNodeSide + k * kBrickSide));
      }
  return tree;
}

bool all_halves(const VoxelTree& tree, int channel) {
  const auto c = static_cast<std::size_t>(channel), channels = static_cast<std::size_t>(tree.channels);
  const auto exact = [](float v) { return bits_of(float{Imath::half(v)}) == bits_of(v); };
  for (std::size_t i = c; i < tree.constants.size(); i += channels)
    if (!exact(tree.constants[i])) return false;
  for (std::size_t i = c * kLeafValues; i < tree.leaves.size(); i += channels * kLeafValues)
    if (!std::all_of(tree.leaves.begin() + static_cast<std::ptrdiff_t>(i),
                     tree.leaves.begin() + static_cast<std::ptrdiff_t>(i + kLeafValues), exact))
      return false;
  return true;
}

namespace {

Result<OwnBricks> made(const VoxelTree& tree, int channel, std::uint64_t max_bytes,
                       std::vector<float>* leaves) {
  return all_halves(tree, channel) ? Maker<std::uint16_t>(tree, channel, max_bytes, leaves).make()
                                   : Maker<float>(tree, channel, max_bytes, leaves).make();
}

}  // namespace

Result<OwnBricks> make_bricks(const VoxelTree& tree, int channel, std::uint64_t max_bytes) {
  return made(tree, channel, max_bytes, nullptr);
}
Result<OwnBricks> make_last_bricks(VoxelTree&& tree, int channel, std::uint64_t max_bytes) {
  return made(tree, channel, max_bytes, &tree.leaves);
}

Bricks::Bricks(const Position& size, const Position& lead, const BrickTables& tables,
               std::shared_ptr<const void> owner)
    : table_(tables.table.data()),
      nodes_(tables.nodes.data()),
      floats_(tables.halves.empty() ? tables.floats.data() : nullptr),
      halves_(tables.halves.empty() ? nullptr : tables.halves.data()),
      lead_(lead),
      size_(size),
      tables_(tables),
      owner_(std::move(owner)) {
  const Position n = table_size(size, lead);
  row_ = {static_cast<std::size_t>(n[0]), static_cast<std::size_t>(n[1])};
  const auto same = [](auto first, std::size_t count) {
    return std::all_of(first, first + static_cast<std::ptrdiff_t>(count),
                       [&](auto v) { return v == *first; });
  };
  same_in_brick_.resize(brick_count());
  for (std::size_t i = 0; i < same_in_brick_.size(); ++i)
    same_in_brick_[i] = halves_ ? same(halves_ + i * kBrickValues, kBrickValues)
                                : same(floats_ + i * kBrickValues, kBrickValues);
  same_in_node_.resize(tables_.nodes.size() / kNodeEntries);
  for (std::size_t i = 0; i < same_in_node_.size(); ++i)
    same_in_node_[i] =
        same_in_brick_[nodes_[i * kNodeEntries]] && same(nodes_ + i * kNodeEntries, kNodeEntries);
}

Bricks::Bricks(const Position& size, const Position& lead, OwnBricks bricks)
    : Bricks([&] {
        const auto own = std::make_shared<const OwnBricks>(std::move(bricks));
        return Bricks(size, lead, *own, own);
      }()) {}

bool Bricks::sound(const Position& size, const Position& lead, const BrickTables& tables) {
  const std::size_t nodes = tables.nodes.size() / kNodeEntries, bricks = tables.brick_count();
  const auto below = [](std::span<const std::uint32_t> numbers, std::size_t end) {
    return std::ranges::all_of(numbers, [=](std::uint32_t n) { return n < end; });
  };
  const auto empty = [](auto values) {
    return values.empty() ||
           std::ranges::all_of(values.first(kBrickValues), [](auto v) { return as_float(v) == 0; });
  };
  return tables.table.size() == table_entries(size, lead) && tables.nodes.size() == nodes * kNodeEntries &&
         tables.floats.size() + tables.halves.size() == bricks * kBrickValues &&
         (tables.floats.empty() || tables.halves.empty()) && nodes > 0 && bricks > 0 &&
         below(tables.table, nodes) && below(tables.nodes, bricks) &&
         below(tables.nodes.first(kNodeEntries), 1) && empty(tables.floats) && empty(tables.halves);
}

// Calls visit(brick, first, last, count) for each brick with values from a to b: these are `count` values, at
// the positions `first` to `last` in the brick. Of a node with one value only one brick is visited, for all
// that the node has from a to b.
template <class Visit>
void Bricks::visit(const Position& a, const Position& b, const Visit& visit) const {
  struct Range {
    int first, last;
    std::uint64_t count() const { return static_cast<std::uint64_t>(last - first + 1); }
  };
  // Clips part number i, of `side` values along axis k, to the nodes from a to b
  const auto part = [&](std::size_t k, int i, int side) {
    return Range{std::max(a[k] + lead_[k] - i * side, 0), std::min(b[k] + lead_[k] - i * side, side - 1)};
  };
  // The numbers of the parts of `side` values along axis k, and of those of the bricks of a node
  const auto parts = [&](std::size_t k, int side) {
    return Range{(a[k] + lead_[k]) / side, (b[k] + lead_[k]) / side};
  };
  const auto bricks_of = [&](std::size_t k, int node) {
    const Range all = parts(k, kBrickSide);
    return Range{std::max(all.first, node * kNodeBricks), std::min(all.last, (node + 1) * kNodeBricks - 1)};
  };
  const auto for_each = [](const Range& x, const Range& y, const Range& z, const auto& f) {
    for (int k = z.first; k <= z.last; ++k)
      for (int j = y.first; j <= y.last; ++j)
        for (int i = x.first; i <= x.last; ++i) f(i, j, k);
  };
  const auto count_of = [](const Range& x, const Range& y, const Range& z) {
    return x.count() * y.count() * z.count();
  };
  for_each(parts(0, kNodeSide), parts(1, kNodeSide), parts(2, kNodeSide), [&](int nx, int ny, int nz) {
    const std::uint32_t node =
        table_[(static_cast<std::size_t>(nz) * row_[1] + static_cast<std::size_t>(ny)) * row_[0] +
               static_cast<std::size_t>(nx)];
    if (same_in_node_[node])
      return visit(nodes_[node * kNodeEntries], Position{}, Position{},
                   count_of(part(0, nx, kNodeSide), part(1, ny, kNodeSide), part(2, nz, kNodeSide)));
    for_each(bricks_of(0, nx), bricks_of(1, ny), bricks_of(2, nz), [&](int bx, int by, int bz) {
      const Range x = part(0, bx, kBrickSide), y = part(1, by, kBrickSide), z = part(2, bz, kBrickSide);
      visit(number(bx, by, bz), Position{x.first, y.first, z.first}, Position{x.last, y.last, z.last},
            count_of(x, y, z));
    });
  });
}

ValueSums Bricks::sums(const Position& a, const Position& b) const {
  ValueSums s;
  visit(a, b, [&](std::uint32_t brick, const Position& first, const Position& last, std::uint64_t count) {
    const std::size_t begin = brick * kBrickValues;
    if (same_in_brick_[brick]) {
      const float v = value(begin);
      s.lo = std::min(s.lo, v);
      s.hi = std::max(s.hi, v);
      s.sum += double{v} * static_cast<double>(count);
      return;
    }
    for (int z = first[2]; z <= last[2]; ++z)
      for (int y = first[1]; y <= last[1]; ++y)
        for (int x = first[0]; x <= last[0]; ++x) {
          const float v = value(begin + in_brick(x, y, z));
          s.lo = std::min(s.lo, v);
          s.hi = std::max(s.hi, v);
          s.sum += v;
        }
  });
  const bool ordered = b[0] - a[0] < kOrderedSide && b[1] - a[1] < kOrderedSide && b[2] - a[2] < kOrderedSide;
  if (ordered && s.lo != s.hi) s.sum = ordered_sum(a, b);
  return s;
}

// The sum in the order of a dense grid, so that its rounding is the same. Empty bricks add 0, and are
// skipped.
double Bricks::ordered_sum(const Position& a, const Position& b) const {
  const auto first_of = [&](std::size_t k) { return (a[k] + lead_[k]) / kBrickSide; };
  const auto last_of = [&](std::size_t k) { return (b[k] + lead_[k]) / kBrickSide; };
  struct Row {
    std::size_t begin;   // index of the brick's first value
    int y, first, last;  // the brick's coordinate along y; positions in the brick along x
  };
  std::vector<Row> rows;
  double sum = 0;
  for (int bz = first_of(2); bz <= last_of(2); ++bz) {
    rows.clear();
    for (int by = first_of(1); by <= last_of(1); ++by)
      for (int bx = first_of(0); bx <= last_of(0); ++bx)
        if (const std::uint32_t n = number(bx, by, bz); n != 0)
          rows.push_back({n * kBrickValues, by, std::max(a[0] + lead_[0] - bx * kBrickSide, 0),
                          std::min(b[0] + lead_[0] - bx * kBrickSide, kBrickSide - 1)});
    for (int z = std::max(a[2] + lead_[2] - bz * kBrickSide, 0);
         z <= std::min(b[2] + lead_[2] - bz * kBrickSide, kBrickSide - 1); ++z)
      for (std::size_t i = 0, end = 0; i < rows.size(); i = end) {
        for (end = i; end < rows.size() && rows[end].y == rows[i].y; ++end) {
        }
        const int begin = rows[i].y * kBrickSide;
        for (int y = std::max(a[1] + lead_[1] - begin, 0);
             y <= std::min(b[1] + lead_[1] - begin, kBrickSide - 1); ++y)
          for (std::size_t r = i; r < end; ++r)
            for (int x = rows[r].first; x <= rows[r].last; ++x)
              sum += value(rows[r].begin + in_brick(x, y, z));
      }
  }
  return sum;
}

std::uint64_t Bricks::count_above(float limit, const Position& a, const Position& b) const {
  std::uint64_t n = 0;
  visit(a, b, [&](std::uint32_t brick, const Position& first, const Position& last, std::uint64_t count) {
    const std::size_t begin = brick * kBrickValues;
    if (same_in_brick_[brick]) {
      n += value(begin) > limit ? count : 0;
      return;
    }
    for (int z = first[2]; z <= last[2]; ++z)
      for (int y = first[1]; y <= last[1]; ++y)
        for (int x = first[0]; x <= last[0]; ++x) n += value(begin + in_brick(x, y, z)) > limit;
  });
  return n;
}

float Bricks::largest() const {
  float largest = 0;
  for (const float v : tables_.floats) largest = std::max(largest, v);
  for (const std::uint16_t v : tables_.halves) largest = std::max(largest, as_float(v));
  return largest;
}

bool Bricks::operator==(const Bricks& other) const {
  return size_ == other.size_ && lead_ == other.lead_ &&
         std::ranges::equal(tables_.table, other.tables_.table) &&
         std::ranges::equal(tables_.nodes, other.tables_.nodes) &&
         std::ranges::equal(tables_.floats, other.tables_.floats) &&
         std::ranges::equal(tables_.halves, other.tables_.halves);
}

Bricks Bricks::mean(const Bricks& a, const Bricks& b, const Bricks& c) {
  using Three = std::array<std::uint32_t, 3>;
  OwnBricks out;
  std::map<Three, std::uint32_t> nodes, bricks;
  const auto brick_of = [&](const Three& three) {
    const auto [known, is_new] = bricks.try_emplace(three, static_cast<std::uint32_t>(bricks.size()));
    for (std::size_t i = 0; is_new && i < kBrickValues; ++i)
      out.floats.push_back(
          static_cast<float>((double{a.value(three[0] * kBrickValues + i)} +
                              b.value(three[1] * kBrickValues + i) + c.value(three[2] * kBrickValues + i)) /
                             3));
    return known->second;
  };
  const auto node_of = [&](const Three& three) {
    const auto [known, is_new] = nodes.try_emplace(three, static_cast<std::uint32_t>(nodes.size()));
    for (std::size_t i = 0; is_new && i < kNodeEntries; ++i)
      out.nodes.push_back(
          brick_of({a.nodes_[three[0] * kNodeEntries + i], b.nodes_[three[1] * kNodeEntries + i],
                    c.nodes_[three[2] * kNodeEntries + i]}));
    return known->second;
  };
  node_of({0, 0, 0});  // the empty one first
  for (std::size_t i = 0; i < a.tables_.table.size(); ++i)
    out.table.push_back(node_of({a.table_[i], b.table_[i], c.table_[i]}));
  return {a.size_, a.lead_, std::move(out)};
}

std::vector<float> Bricks::dense() const {
  std::vector<float> all;
  all.reserve(static_cast<std::size_t>(size_[0]) * static_cast<std::size_t>(size_[1]) *
              static_cast<std::size_t>(size_[2]));
  for (int z = 0; z < size_[2]; ++z)
    for (int y = 0; y < size_[1]; ++y)
      for (int x = 0; x < size_[0]; ++x) all.push_back(at(x, y, z));
  return all;
}

}  // namespace ls::render
