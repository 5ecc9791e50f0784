#include "worker/render/media/vdb_reply.h"

#include <malloc.h>
#include <openvdb/io/Archive.h>
#include <openvdb/io/GridDescriptor.h>
#include <openvdb/io/io.h>
#include <openvdb/openvdb.h>

#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <istream>
#include <iterator>
#include <map>
#include <memory>
#include <mutex>
#include <new>
#include <optional>
#include <streambuf>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/base/file_form.h"
#include "worker/render/vdb/nvdb.h"
#include "worker/render/vdb/read_tree.h"

namespace {

using ls::render::Coord;
using ls::render::Refused;
using ls::render::Value;
using ls::render::VdbShape;
using ls::render::VdbVoxels;

constexpr std::uintmax_t kSmallFile = 16 << 20;
constexpr char kDamaged[] = "not a readable OpenVDB or NanoVDB file: damaged, or cut short";

void initialize_once() {
  static std::once_flag flag;
  std::call_once(flag, [] { openvdb::initialize(); });
}

template <class T>
float component(const T& value, int) {
  return static_cast<float>(value);
}
template <class T>
float component(const openvdb::math::Vec3<T>& value, int k) {
  return static_cast<float>(value[k]);
}

// A grid of OpenVDB, for TreeReader. Each node is taken out of the grid when it is read, and freed after
// that, so that the voxels are not in memory twice.
template <class GridType>
class Source {
 public:
  using Tree = typename GridType::TreeType;
  using Node = typename Tree::RootNodeType::ChildNodeType::ChildNodeType;
  using Leaf = typename Tree::LeafNodeType;
  static_assert(Node::DIM == ls::render::kNodeSide && Leaf::DIM == ls::render::kBrickSide);

  explicit Source(GridType& grid) : tree_(grid.tree()) {}

  std::optional<const Node*> node(const Coord& origin, Value& all) {
    free_node();
    openvdb::Coord c;
    for (int k = 0; k < 3; ++k) {
      // The box of the voxels may reach one voxel beyond what coordinates can be.
      if (origin[static_cast<std::size_t>(k)] !=
          static_cast<std::int32_t>(origin[static_cast<std::size_t>(k)])) {
        all = of(tree_.background());
        return std::nullopt;
      }
      c[k] = static_cast<std::int32_t>(origin[static_cast<std::size_t>(k)]);
    }
    if (tree_.template probeConstNode<Node>(c)) {
      node_.reset(tree_.template stealNode<Node>(c, tree_.background(), false));
      return node_.get();
    }
    all = of(tree_.getValue(c));
    return std::nullopt;
  }
  std::optional<const Leaf*> leaf(const Node* node, int x, int y, int z, Value& all) const {
    const auto n =
        static_cast<openvdb::Index>((x * ls::render::kNodeBricks + y) * ls::render::kNodeBricks + z);
    const auto& child = node->getTable()[n];
    if (node->getChildMask().isOn(n)) return child.getChild();
    all = of(child.getValue());
    return std::nullopt;
  }
  Value voxel(const Leaf* leaf, int x, int y, int z) const {
    return of(leaf->getValue(
        static_cast<openvdb::Index>((x * ls::render::kBrickSide + y) * ls::render::kBrickSide + z)));
  }

 private:
  static Value of(const typename GridType::ValueType& value) {
    Value all{};
    for (std::size_t k = 0; k < (openvdb::VecTraits<typename GridType::ValueType>::IsVec ? 3 : 1); ++k)
      all[k] = component(value, static_cast<int>(k));
    return all;
  }

  void free_node() {
    if (!node_) return;
    freed_ += node_->leafCount();
    node_.reset();
    // The allocator keeps what is freed, unless told otherwise.
    constexpr std::uint64_t kManyLeaves = 16384;
    if (freed_ < kManyLeaves) return;
    ::malloc_trim(0);
    freed_ = 0;
  }

  Tree& tree_;
  std::unique_ptr<Node> node_;
  std::uint64_t freed_ = 0;  // leaves since the last trim
};

void place(const openvdb::GridBase& grid, const openvdb::Vec3d& lo, VdbShape& out) {
  const auto& map = grid.transform();
  if (!map.isLinear())
    throw Refused{
        1, "grid '" + grid.getName() + "' has a perspective transform; only linear ones can be rendered"};
  const openvdb::Vec3d o = map.indexToWorld(lo);
  for (int k = 0; k < 3; ++k) {
    openvdb::Vec3d e = lo;
    e[k] += 1;
    const openvdb::Vec3d axis = map.indexToWorld(e) - o;
    for (int r = 0; r < 3; ++r) out.index_to_scene[4 * r + k] = axis[r];
  }
  for (int r = 0; r < 3; ++r) out.index_to_scene[4 * r + 3] = o[r];
  out.index_to_scene[15] = 1;
}

template <class GridType>
void convert(const openvdb::GridBase::Ptr& base, std::uint64_t max_bytes, VdbVoxels& out) {
  const auto grid = openvdb::gridPtrCast<GridType>(base);
  const openvdb::CoordBBox box = grid->evalActiveVoxelBoundingBox();
  if (box.empty()) throw Refused{1, "grid '" + grid->getName() + "' is empty: it has no active voxel"};
  out.shape.channels = out.tree.channels = openvdb::VecTraits<typename GridType::ValueType>::IsVec ? 3 : 1;
  Coord lo, end;
  for (int k = 0; k < 3; ++k) {
    lo[static_cast<std::size_t>(k)] = std::int64_t{box.min()[k]} - 1;
    end[static_cast<std::size_t>(k)] = std::int64_t{box.max()[k]} + 2;
  }
  out.name = grid->getName();
  ls::render::set_box(lo, end, out);
  place(*grid, {static_cast<double>(lo[0]), static_cast<double>(lo[1]), static_cast<double>(lo[2])},
        out.shape);
  const std::uint64_t values = std::uint64_t{grid->tree().leafCount()} *
                               static_cast<std::uint64_t>(out.shape.channels) * ls::render::kLeafValues;
  if (values > max_bytes / sizeof(float)) throw ls::render::too_large(out, max_bytes);
  out.tree.leaves.reserve(values);
  Source source(*grid);
  ls::render::TreeReader(source, lo, end, max_bytes, out).read();
}

// Refuses a grid whose values are no densities, by their type, before its voxels are read.
void check_type(const openvdb::GridBase& grid, const std::string& name) {
  if (grid.isType<openvdb::FloatGrid>() || grid.isType<openvdb::DoubleGrid>() ||
      grid.isType<openvdb::Vec3SGrid>() || grid.isType<openvdb::Vec3DGrid>())
    return;
  if (grid.type().find("ptdataidx") != std::string::npos || grid.type().find("ptidx") != std::string::npos)
    throw Refused{1,
                  "grid '" + name +
                      "' holds points, not a density; convert it to a fog volume, or give another grid_name"};
  throw Refused{1, "grid '" + name + "' has values of type " + grid.valueType() +
                       "; a density is float or double, one number or three"};
}

// An OpenVDB file. OpenVDB's own io::File does not notice that a file ends too early: where the values are
// stored without a codec, it takes bytes beyond the end as whatever its buffers hold. Here a read beyond the
// end throws, and a grid must end where the file says.
class VdbFile : private openvdb::io::Archive {
 public:
  // `in` must outlive this object; `bytes` is the number of its bytes.
  VdbFile(std::istream& in, std::uint64_t bytes) : in_(in), bytes_(bytes) {
    in_.exceptions(std::ios::failbit | std::ios::badbit | std::ios::eofbit);
    readHeader(in_);
    // A file of a newer format version is rejected here; OpenVDB would only warn.
    if (fileVersion() > openvdb::OPENVDB_FILE_VERSION)
      throw Refused{1, "it is of version " + std::to_string(fileVersion()) +
                           " of the OpenVDB format; versions up to " +
                           std::to_string(openvdb::OPENVDB_FILE_VERSION) + " can be read"};
    metadata_.reset(new openvdb::io::StreamMetadata);
    metadata_->setSeekable(true);
    openvdb::io::setStreamMetadataPtr(in_, metadata_, /*transfer=*/false);
    setFormatVersion(in_);
    setLibraryVersion(in_);
    setDataCompression(in_);
    openvdb::MetaMap().readMeta(in_);
    const std::int32_t count = readGridCount(in_);
    for (std::int32_t i = 0; i < count; ++i) read_entry();
  }

  // The names of the grids, in the order of their numbers for read_grid(). Of several grids of one name each
  // has a number in brackets.
  std::vector<std::string> names() const {
    std::vector<std::string> all;
    for (const auto& [name, entry] : entries_) all.push_back(openvdb::io::GridDescriptor::nameAsString(name));
    return all;
  }

  openvdb::GridBase::Ptr read_grid(std::size_t index) {
    const Entry& entry = std::next(entries_.begin(), static_cast<std::ptrdiff_t>(index))->second;
    openvdb::GridBase::Ptr grid = read_alone(entry);
    if (!entry.place.isInstance()) return grid;
    // The grid shares the tree of another one, which alone has it in the file.
    const auto parent = entries_.find(entry.place.instanceParentName());
    if (parent == entries_.end() || parent->second.place.isInstance()) throw Refused{1, kDamaged};
    grid->setTree(read_alone(parent->second)->baseTreePtr());
    return grid;
  }

 private:
  struct Entry {
    openvdb::io::GridDescriptor place;
    openvdb::GridBase::Ptr grid;  // without its tree, unless the file was read as a stream
  };

  // Reads the next entry of the file's list of grids. If the file has no offsets, because it was written as a
  // stream, the whole grid follows its entry.
  void read_entry() {
    Entry entry;
    entry.grid = entry.place.read(in_);
    if (inputHasGridOffsets()) {
      const auto end = static_cast<std::uint64_t>(entry.place.getEndPos());
      if (end > bytes_)
        throw Refused{1, std::string(kDamaged) + ": grid '" + entry.place.gridName() + "' ends at byte " +
                             std::to_string(end) + " of " + std::to_string(bytes_)};
      entry.place.seekToEnd(in_);
    } else {
      readGrid(entry.grid, entry.place, in_);
    }
    entries_.emplace(entry.place.uniqueName(), entry);
  }

  openvdb::GridBase::Ptr read_alone(const Entry& entry) {
    if (entry.grid) check_type(*entry.grid, entry.place.gridName());
    if (!entry.grid || !inputHasGridOffsets()) return entry.grid;
    entry.place.seekToGrid(in_);
    readGrid(entry.grid, entry.place, in_);
    if (static_cast<std::int64_t>(in_.tellg()) != entry.place.getEndPos()) throw Refused{1, kDamaged};
    return entry.grid;
  }

  std::istream& in_;
  const std::uint64_t bytes_;
  openvdb::io::StreamMetadata::Ptr metadata_;
  std::multimap<std::string, Entry> entries_;  // by unique name
};

// A stream of bytes in memory, in which one can seek.
class MemoryBuffer final : public std::streambuf {
 public:
  explicit MemoryBuffer(std::vector<std::byte>& bytes) {
    auto* first = reinterpret_cast<char*>(bytes.data());
    setg(first, first, first + bytes.size());
  }

 private:
  pos_type seekoff(off_type by, std::ios::seekdir from, std::ios::openmode) override {
    const off_type base = from == std::ios::beg   ? 0
                          : from == std::ios::cur ? gptr() - eback()
                                                  : egptr() - eback();
    if (base + by < 0 || base + by > egptr() - eback()) return pos_type(off_type(-1));
    setg(eback(), eback() + base + by, egptr());
    return pos_type(base + by);
  }
  pos_type seekpos(pos_type to, std::ios::openmode which) override {
    return seekoff(off_type(to), std::ios::beg, which);
  }
};

void read(std::istream& in, std::uint64_t bytes, const std::string& wanted, std::uint64_t max_bytes,
          VdbVoxels& out) {
  VdbFile file(in, bytes);
  const openvdb::GridBase::Ptr base = file.read_grid(ls::render::choose_grid(file.names(), wanted));
  if (!base) throw Refused{1, "the grid cannot be read"};
  if (base->getGridClass() == openvdb::GRID_LEVEL_SET) {
    throw Refused{1,
                  "grid '" + base->getName() + "' is a level set, not a density; convert it to a fog volume"};
  }
  if (base->getGridClass() == openvdb::GRID_STAGGERED) {
    throw Refused{1, "grid '" + base->getName() +
                         "' is staggered: its values are flows through the faces of voxels, not a density"};
  }
  if (base->isType<openvdb::FloatGrid>()) return convert<openvdb::FloatGrid>(base, max_bytes, out);
  if (base->isType<openvdb::DoubleGrid>()) return convert<openvdb::DoubleGrid>(base, max_bytes, out);
  if (base->isType<openvdb::Vec3SGrid>()) return convert<openvdb::Vec3SGrid>(base, max_bytes, out);
  convert<openvdb::Vec3DGrid>(base, max_bytes, out);
}

// Reads a .vdb or .nvdb file, which may be packed by gzip.
void read_file(const std::filesystem::path& path, const std::string& wanted, std::uint64_t max_bytes,
               VdbVoxels& out) {
  char head[ls::kFormBytes] = {};
  std::ifstream in(path, std::ios::binary);
  in.read(head, sizeof head);
  const std::string_view start(head, static_cast<std::size_t>(in.gcount()));
  if (const std::string why = ls::why_placeholder(start); !why.empty()) throw Refused{1, "it " + why};
  const bool packed = ls::is_gzip(start);
  if (packed || ls::render::is_nvdb(start)) {
    auto bytes = ls::render::file_bytes(path);
    if (packed) {
      auto plain = ls::plain_bytes(path.filename().string(), std::move(bytes));
      if (!plain)
        throw Refused{plain.error().code == ls::Errc::resource_exhausted ? 2 : 1, plain.error().message};
      bytes = std::move(*plain);
    }
    if (ls::render::is_nvdb({reinterpret_cast<const char*>(bytes.data()), bytes.size()})) {
      out = ls::render::decode_nvdb(bytes, wanted, max_bytes);
      return;
    }
    MemoryBuffer buffer(bytes);
    std::istream memory(&buffer);
    return read(memory, bytes.size(), wanted, max_bytes, out);
  }
  in.clear();
  in.seekg(0);
  read(in, std::filesystem::file_size(path), wanted, max_bytes, out);
}

// Makes the bricks of all channels, which together may take max_bytes.
void make_all_bricks(VdbVoxels voxels, std::uint64_t max_bytes, ls::render::VdbGrid& out) {
  out.shape = voxels.shape;
  std::uint64_t left = max_bytes;
  for (int c = 0; c < voxels.shape.channels; ++c) {
    const bool last = c == voxels.shape.channels - 1;
    auto bricks = last ? ls::render::make_last_bricks(std::move(voxels.tree), c, left)
                       : ls::render::make_bricks(voxels.tree, c, left);
    if (!bricks) throw ls::render::too_large(voxels, max_bytes);
    left -= ls::render::BrickTables(*bricks).bytes();
    out.channels.push_back(std::move(*bricks));
  }
}

}  // namespace

namespace ls::render {

int read_vdb(const std::string& path, const std::string& grid_name, std::uint64_t max_bytes, VdbGrid& out,
             std::string& error) {
  const auto say = [&](int code, std::string text) {
    error = std::move(text);
    out = {};
    return code;
  };
  try {
    initialize_once();
    VdbVoxels voxels;
    read_file(path, grid_name, max_bytes, voxels);
    make_all_bricks(std::move(voxels), max_bytes, out);
    return 0;
  } catch (const Refused& r) {
    return say(r.code, r.text);
  } catch (const std::bad_alloc&) {
    // If memory runs out while a file smaller than kSmallFile is read, the file is damaged: the sizes that it
    // claims are wrong.
    std::error_code unknown;
    const auto bytes = std::filesystem::file_size(path, unknown);
    if (!unknown && bytes < kSmallFile) return say(1, kDamaged);
    return say(2, "the grid does not fit into memory");
  } catch (const std::ios::failure&) {
    return say(1, kDamaged);
  } catch (const std::exception& e) {
    return say(1, std::string("not a readable OpenVDB file: ") + e.what());
  } catch (...) {
    return say(1, "not a readable OpenVDB file");
  }
}

}  // namespace ls::render
