#include <Imath/half.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>

#include "worker/render/vdb/nvdb.h"
#include "worker/render/vdb/read_tree.h"

namespace ls::render {
namespace {

// Byte offsets of fields in the grid's header, which has kGrid = 672 bytes, and in the tree that follows it.
// kMatrix and kOffset are relative to kMap, kRootOffset to the tree's start, and the child masks to their
// node. Offsets that depend on the type of values are in Layout.
constexpr std::uint64_t kGrid = 672, kGridSize = 32, kMap = 296, kMatrix = 88, kOffset = 232, kClass = 632,
                        kType = 636, kRootOffset = 24;
constexpr std::uint64_t kUpperChildMask = 4128, kLowerChildMask = 544;
constexpr int kUpperSide = 4096, kUpperChildren = 32;

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
std::string type_name(std::uint32_t type) {
  static constexpr const char* kNames[] = {"unknown", "float", "double", "int16",  "int32", "int64", "vec3f",
                                           "vec3d",   "mask",  "half",   "uint32", "bool",  "rgba8", "Fp4",
                                           "Fp8",     "Fp16",  "FpN",    "vec4f",  "vec4d", "index"};
  return type < std::size(kNames) ? kNames[type] : "number " + std::to_string(type);
}

class Tree {
 public:
  Tree(const std::string& name, const NvdbBytes& bytes) : name_(name), b_(bytes) {}

  void read(std::uint64_t max_bytes, VdbVoxels& out) {
    check_header(out);
    root_ = kGrid + b_.get<std::uint64_t>(kGrid + kRootOffset);
    if (root_ < kGrid) fault("its tree lies before it");
    Coord lo, end;
    place(lo, end, out);
    find_tiles();
    TreeReader(*this, lo, end, max_bytes, out).read();
  }

  // The functions that TreeReader needs. A node and a leaf are their byte offsets.
  std::optional<std::uint64_t> node(const Coord& origin, Value& all) const {
    // The box of the voxels may reach one voxel beyond what coordinates can be.
    const bool within =
        std::ranges::all_of(origin, [](std::int64_t c) { return c == static_cast<std::int32_t>(c); });
    const auto found = within ? tiles_.find(key_of(origin)) : tiles_.end();
    if (found == tiles_.end()) {
      all = value(root_ + layout_.background);
      return std::nullopt;
    }
    const std::uint64_t tile = found->second;
    const auto child = b_.get<std::int64_t>(tile + 8);
    if (child == 0) {
      all = value(tile + layout_.tile_value);
      return std::nullopt;
    }
    std::uint32_t n = 0;
    for (const std::int64_t c : origin)
      n = n * kUpperChildren + static_cast<std::uint32_t>((c & (kUpperSide - 1)) / kNodeSide);
    return child_of(at(root_, child), kUpperChildMask, layout_.upper_table, n, all);
  }
  std::optional<std::uint64_t> leaf(std::uint64_t node, int x, int y, int z, Value& all) const {
    return child_of(node, kLowerChildMask, layout_.lower_table,
                    static_cast<std::uint32_t>((x * kNodeBricks + y) * kNodeBricks + z), all);
  }
  Value voxel(std::uint64_t leaf, int x, int y, int z) const {
    return voxel(leaf, static_cast<std::uint32_t>((x * kBrickSide + y) * kBrickSide + z));
  }

 private:
  [[noreturn]] void fault(const std::string& why) const {
    throw Refused{1, "not a readable NanoVDB file: grid '" + name_ + "': " + why};
  }

  void check_header(VdbVoxels& out) {
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
    channels_ = type_ == kVec3f || type_ == kVec3d ? 3 : 1;
    out.shape.channels = out.tree.channels = static_cast<int>(channels_);
  }

  // Finds the box of voxels to read, which is that of the active voxels enlarged by one voxel on each side,
  // and the transform from the nodes of the box to the scene (VdbShape::index_to_scene).
  void place(Coord& lo_voxel, Coord& end, VdbVoxels& out) const {
    for (int k = 0; k < 3; ++k) {
      const std::int64_t lo = b_.get<std::int32_t>(root_ + 4 * k),
                         hi = b_.get<std::int32_t>(root_ + 12 + 4 * k);
      if (hi < lo) throw Refused{1, "grid '" + name_ + "' is empty: it has no active voxel"};
      lo_voxel[k] = lo - 1;
      end[k] = hi + 2;
    }
    set_box(lo_voxel, end, out);
    double m[9], v[3];
    for (int i = 0; i < 9; ++i) m[i] = b_.get<double>(kMap + kMatrix + 8 * i);
    for (int i = 0; i < 3; ++i) v[i] = b_.get<double>(kMap + kOffset + 8 * i);
    double* t = out.shape.index_to_scene;
    for (int r = 0; r < 3; ++r) {
      t[4 * r + 3] = v[r];
      for (int c = 0; c < 3; ++c) {
        t[4 * r + c] = m[3 * r + c];
        t[4 * r + 3] += m[3 * r + c] * static_cast<double>(lo_voxel[c]);
      }
    }
    t[15] = 1;
    for (int i = 0; i < 16; ++i)
      if (!std::isfinite(t[i])) fault("its transform is not finite");
  }

  double number(std::uint64_t at) const {
    if (type_ == kDouble || type_ == kVec3d) return b_.get<double>(at);
    if (type_ != kHalf) return b_.get<float>(at);
    Imath::half h;
    h.setBits(b_.get<std::uint16_t>(at));
    return h;
  }
  Value value(std::uint64_t at) const {
    Value v{};
    for (std::uint64_t c = 0; c < channels_; ++c)
      v[c] = static_cast<float>(number(at + (type_ == kVec3d ? 8 : 4) * c));
    return v;
  }

  // Returns the value of voxel number n of the leaf at the byte offset `leaf`. A leaf of a quantised type
  // (Fp4 to FpN) stores a minimum, a step, and for each voxel a code of 1 to 16 bits: the value is the
  // minimum plus the code times the step.
  Value voxel(std::uint64_t leaf, std::uint32_t n) const {
    const std::uint64_t table = leaf + layout_.leaf_table;
    if (type_ == kDouble || type_ == kVec3d) return value(table + 8 * channels_ * n);
    if (type_ == kFloat || type_ == kVec3f) return value(table + 4 * channels_ * n);
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

  // The key of the root's tile that a voxel is in
  static std::uint64_t key_of(const Coord& c) {
    std::uint64_t key = 0;
    for (std::size_t k = 0; k < 3; ++k)
      key |= std::uint64_t{static_cast<std::uint32_t>(c[k]) >> 12} << 21 * (2 - k);
    return key;
  }
  void find_tiles() {
    const auto tiles = b_.get<std::uint32_t>(root_ + 24);
    for (std::uint32_t i = 0; i < tiles; ++i) {
      const std::uint64_t tile = root_ + layout_.root_size + layout_.root_tile * i;
      if (!tiles_.emplace(b_.get<std::uint64_t>(tile), tile).second)
        fault("two of its tiles are at one place");
    }
  }

  std::uint64_t at(std::uint64_t base, std::int64_t offset) const {
    if (offset < 0) fault("a node points backwards");
    return base + static_cast<std::uint64_t>(offset);
  }

  // Returns the byte offset of child number n of the node at the byte offset `node`, or nullopt if the child
  // is a constant, and then the constant in `all`.
  std::optional<std::uint64_t> child_of(std::uint64_t node, std::uint64_t mask, std::uint64_t table,
                                        std::uint32_t n, Value& all) const {
    const std::uint64_t entry = node + table + layout_.table_step * n;
    if (b_.bit(node + mask, n)) return at(node, b_.get<std::int64_t>(entry));
    all = value(entry);
    return std::nullopt;
  }

  const std::string& name_;
  const NvdbBytes& b_;
  Type type_ = kFloat;
  Layout layout_{};
  std::uint64_t root_ = 0, channels_ = 1;
  std::map<std::uint64_t, std::uint64_t> tiles_;  // byte offsets of the root's tiles, by their keys
};

}  // namespace

VdbVoxels read_nvdb_grid(const std::string& name, std::span<const std::byte> buffer,
                         std::uint64_t max_bytes) {
  const NvdbBytes bytes(buffer, "its buffer");
  VdbVoxels out;
  out.name = name;
  Tree(name, bytes).read(max_bytes, out);
  return out;
}

}  // namespace ls::render
