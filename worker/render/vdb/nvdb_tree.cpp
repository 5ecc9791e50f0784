#include <Imath/half.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <set>

#include "worker/render/vdb/nvdb.h"

namespace ls::render {
namespace {

using Coord = std::array<std::int64_t, 3>;

// Byte offsets of fields in the grid's header, which has kGrid = 672 bytes, and in the tree that follows it.
// kMatrix and kOffset are relative to kMap, kRootOffset to the tree's start, and the child masks to their
// node. Offsets that depend on the type of values are in Layout.
constexpr std::uint64_t kGrid = 672, kGridSize = 32, kMap = 296, kMatrix = 88, kOffset = 232, kClass = 632,
                        kType = 636, kRootOffset = 24;
constexpr std::uint64_t kUpperChildMask = 4128, kLowerChildMask = 544;
constexpr int kUpperSide = 4096, kLowerSide = 128, kLeafSide = 8;

enum Type : std::uint32_t {
  kFloat = 1,
  kDouble = 2,
  kVec3f = 6,
  kVec3d = 7,
  kHalf = 9,
  kFp4 = 13,
  kFp8 = 14,
  kFp16 = 15,
  kFpN = 16
};
constexpr std::uint32_t kTypes[] = {kFloat, kDouble, kVec3f, kVec3d, kHalf, kFp4, kFp8, kFp16, kFpN};
struct Layout {
  std::uint64_t background, root_size, tile_value, root_tile, upper_table, lower_table, table_step,
      leaf_table;
};
Layout layout_of(Type type) {
  if (type == kDouble) return {32, 96, 24, 32, 8256, 1088, 8, 128};
  if (type == kVec3f) return {28, 96, 20, 32, 8256, 1088, 16, 128};
  if (type == kVec3d) return {32, 192, 24, 64, 8288, 1120, 24, 160};
  return {28, 64, 20, 32, 8256, 1088, 8, 96};
}
// The value of a voxel: 3 components, of which a grid with one channel uses only the first.
using Value = std::array<float, 3>;

std::string type_name(std::uint32_t type) {
  static constexpr const char* kNames[] = {"unknown", "float", "double", "int16",  "int32", "int64", "vec3f",
                                           "vec3d",   "mask",  "half",   "uint32", "bool",  "rgba8", "Fp4",
                                           "Fp8",     "Fp16",  "FpN",    "vec4f",  "vec4d", "index"};
  return type < std::size(kNames) ? kNames[type] : "number " + std::to_string(type);
}

class Tree {
 public:
  Tree(const std::string& name, const NvdbBytes& bytes, std::uint64_t max_values, LsVdbGrid& out)
      : name_(name), b_(bytes), max_values_(max_values), out_(out) {}

  void expand() {
    check_header();
    root_ = kGrid + b_.get<std::uint64_t>(kGrid + kRootOffset);
    if (root_ < kGrid) fault("its tree lies before it");
    place();
    out_.values = room_for(values_of(out_));
    fill(lo_, end_, value(root_ + layout_.background));
    read_root();
  }

 private:
  [[noreturn]] void fault(const std::string& why) const {
    throw Refused{1, "not a readable NanoVDB file: grid '" + name_ + "': " + why};
  }

  void check_header() {
    const auto magic = b_.part(0, 8);
    const std::string m(reinterpret_cast<const char*>(magic.data()), 8);
    if (m != "NanoVDB0" && m != "NanoVDB1") fault("its data begins with something else");
    if (b_.get<std::uint64_t>(kGridSize) != b_.size()) fault("its sizes contradict each other");
    const auto type = b_.get<std::uint32_t>(kType), grid_class = b_.get<std::uint32_t>(kClass);
    if (grid_class == 1)
      throw Refused{1, "grid '" + name_ + "' is a level set, not a density; convert it to a fog volume"};
    if (!std::ranges::count(kTypes, type))
      throw Refused{1,
                    "grid '" + name_ + "' has values of type " + type_name(type) +
                        "; a density is float, double, vec3f, vec3d, half or one of Fp4, Fp8, Fp16 and FpN"};
    type_ = static_cast<Type>(type);
    layout_ = layout_of(type_);
    out_.channels = type_ == kVec3f || type_ == kVec3d ? 3 : 1;
  }

  // Finds the box of voxels to read, which is that of the active voxels enlarged by one voxel on each side,
  // and the transform from the nodes of the box to the scene (LsVdbGrid::index_to_scene).
  void place() {
    std::array<std::int64_t, 3> size;
    for (int k = 0; k < 3; ++k) {
      const std::int64_t lo = b_.get<std::int32_t>(root_ + 4 * k),
                         hi = b_.get<std::int32_t>(root_ + 12 + 4 * k);
      if (hi < lo) throw Refused{1, "grid '" + name_ + "' is empty: it has no active voxel"};
      lo_[k] = lo - 1;
      end_[k] = hi + 2;
      size[k] = end_[k] - lo_[k];
    }
    set_size(name_, size, max_values_, out_);
    double m[9], v[3];
    for (int i = 0; i < 9; ++i) m[i] = b_.get<double>(kMap + kMatrix + 8 * i);
    for (int i = 0; i < 3; ++i) v[i] = b_.get<double>(kMap + kOffset + 8 * i);
    double* t = out_.index_to_scene;
    for (int r = 0; r < 3; ++r) {
      t[4 * r + 3] = v[r];
      for (int c = 0; c < 3; ++c) {
        t[4 * r + c] = m[3 * r + c];
        t[4 * r + 3] += m[3 * r + c] * static_cast<double>(lo_[c]);
      }
    }
    t[15] = 1;
    for (int i = 0; i < 16; ++i)
      if (!std::isfinite(t[i])) fault("its transform is not finite");
  }

  std::uint64_t channels() const { return static_cast<std::uint64_t>(out_.channels); }
  double number(std::uint64_t at) const {
    if (type_ == kDouble || type_ == kVec3d) return b_.get<double>(at);
    if (type_ != kHalf) return b_.get<float>(at);
    Imath::half h;
    h.setBits(b_.get<std::uint16_t>(at));
    return h;
  }
  Value value(std::uint64_t at) const {
    Value v{};
    for (std::uint64_t c = 0; c < channels(); ++c)
      v[c] = static_cast<float>(number(at + (type_ == kVec3d ? 8 : 4) * c));
    return v;
  }

  // Returns the value of voxel number n of the leaf at the byte offset `leaf`. A leaf of a quantised type
  // (Fp4 to FpN) stores a minimum, a step, and for each voxel a code of 1 to 16 bits: the value is the
  // minimum plus the code times the step.
  Value voxel(std::uint64_t leaf, std::uint32_t n) const {
    const std::uint64_t table = leaf + layout_.leaf_table;
    if (type_ == kDouble || type_ == kVec3d) return value(table + 8 * channels() * n);
    if (type_ == kFloat || type_ == kVec3f) return value(table + 4 * channels() * n);
    if (type_ == kHalf) return value(table + 2 * n);
    const std::uint32_t log_bits = type_ == kFp4    ? 2
                                   : type_ == kFp8  ? 3
                                   : type_ == kFp16 ? 4
                                                    : b_.get<std::uint32_t>(leaf + 12) >> 29;
    if (log_bits > 4) fault("a leaf has codes of more than 16 bits");
    const std::uint32_t per_word = 5 - log_bits, bits = 1u << log_bits;
    const auto word = b_.get<std::uint32_t>(table + 4 * (n >> per_word));
    const std::uint32_t code = word >> ((n & ((1u << per_word) - 1)) << log_bits) & ((1u << bits) - 1);
    return {static_cast<float>(code) * b_.get<float>(table - 12) + b_.get<float>(table - 16)};
  }

  void read_root() {
    const auto tiles = b_.get<std::uint32_t>(root_ + 24);
    std::set<std::uint64_t> keys;
    for (std::uint32_t i = 0; i < tiles; ++i) {
      const std::uint64_t tile = root_ + layout_.root_size + layout_.root_tile * i;
      const auto key = b_.get<std::uint64_t>(tile);
      if (!keys.insert(key).second) fault("two of its tiles are at one place");
      Coord origin;
      for (int k = 0; k < 3; ++k)
        origin[k] =
            static_cast<std::int32_t>(static_cast<std::uint32_t>(key >> 21 * (2 - k) & 0xfffff) << 12);
      if (!meets(origin, kUpperSide)) continue;
      const auto child = b_.get<std::int64_t>(tile + 8);
      if (child == 0)
        fill_node(origin, kUpperSide, value(tile + layout_.tile_value));
      else
        inner(at(root_, child), origin, kUpperSide);
    }
  }

  std::uint64_t at(std::uint64_t base, std::int64_t offset) const {
    if (offset < 0) fault("a node points backwards");
    return base + static_cast<std::uint64_t>(offset);
  }

  // Reads the node at the byte offset `node`, which spans `side` voxels along each axis: an upper node (32^3
  // children of 128^3 voxels each) or a lower node (16^3 children of 8^3 voxels each).
  void inner(std::uint64_t node, const Coord& origin, int side) {
    const bool upper = side == kUpperSide;
    const int child_side = upper ? kLowerSide : kLeafSide, per_axis = side / child_side;
    const std::uint64_t mask = node + (upper ? kUpperChildMask : kLowerChildMask),
                        table = node + (upper ? layout_.upper_table : layout_.lower_table);
    std::array<int, 3> first{}, last{};
    for (int k = 0; k < 3; ++k) {
      first[k] = static_cast<int>(std::max<std::int64_t>(0, lo_[k] - origin[k]) / child_side);
      last[k] = static_cast<int>(std::min<std::int64_t>(side, end_[k] - origin[k]) - 1) / child_side;
    }
    for (int x = first[0]; x <= last[0]; ++x)
      for (int y = first[1]; y <= last[1]; ++y)
        for (int z = first[2]; z <= last[2]; ++z) {
          const auto n = static_cast<std::uint32_t>((x * per_axis + y) * per_axis + z);
          const Coord at_child{origin[0] + x * child_side, origin[1] + y * child_side,
                               origin[2] + z * child_side};
          if (!b_.bit(mask, n)) {
            fill_node(at_child, child_side, value(table + layout_.table_step * n));
            continue;
          }
          const std::uint64_t child = at(node, b_.get<std::int64_t>(table + layout_.table_step * n));
          if (upper)
            inner(child, at_child, kLowerSide);
          else
            leaf(child, at_child);
        }
  }

  void leaf(std::uint64_t node, const Coord& origin) {
    for (int x = 0; x < kLeafSide; ++x)
      for (int y = 0; y < kLeafSide; ++y)
        for (int z = 0; z < kLeafSide; ++z) {
          const Coord c{origin[0] + x, origin[1] + y, origin[2] + z};
          if (meets(c, 1)) set(c, voxel(node, static_cast<std::uint32_t>((x * 8 + y) * 8 + z)));
        }
  }

  bool meets(const Coord& c, int side) const {
    for (int k = 0; k < 3; ++k)
      if (c[k] >= end_[k] || c[k] + side <= lo_[k]) return false;
    return true;
  }
  void fill_node(const Coord& c, int side, const Value& value) {
    Coord a, e;
    for (int k = 0; k < 3; ++k) {
      a[k] = std::max(c[k], lo_[k]);
      e[k] = std::min(c[k] + side, end_[k]);
    }
    fill(a, e, value);
  }
  void fill(const Coord& a, const Coord& e, const Value& value) {
    for (std::int64_t z = a[2]; z < e[2]; ++z)
      for (std::int64_t y = a[1]; y < e[1]; ++y)
        for (std::int64_t x = a[0]; x < e[0]; ++x) set({x, y, z}, value);
  }
  void set(const Coord& c, const Value& value) {
    if (!std::isfinite(value[0]) || !std::isfinite(value[1]) || !std::isfinite(value[2]))
      throw Refused{1, "voxel (" + std::to_string(c[0]) + ", " + std::to_string(c[1]) + ", " +
                           std::to_string(c[2]) + ") of grid '" + name_ + "' is not a finite number"};
    const auto i = ((c[2] - lo_[2]) * out_.size[1] + (c[1] - lo_[1])) * out_.size[0] + (c[0] - lo_[0]);
    std::copy_n(value.begin(), channels(), out_.values + static_cast<std::uint64_t>(i) * channels());
  }

  const std::string& name_;
  const NvdbBytes& b_;
  const std::uint64_t max_values_;
  LsVdbGrid& out_;
  Type type_ = kFloat;
  Layout layout_{};
  std::uint64_t root_ = 0;
  Coord lo_{}, end_{};  // the box of voxels that is read: from lo_ to before end_
};

}  // namespace

void expand_nvdb(const std::string& name, std::span<const std::byte> buffer, std::uint64_t max_values,
                 LsVdbGrid& out) {
  const NvdbBytes bytes(buffer, "its buffer");
  Tree(name, bytes, max_values, out).expand();
  for (float& v : std::span(out.values, values_of(out))) {
    if (!(v < 0)) continue;
    ++out.negatives;
    v = 0;
  }
}

}  // namespace ls::render
