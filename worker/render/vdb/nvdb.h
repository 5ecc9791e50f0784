// Reader of NanoVDB files (.nvdb) of ABI 32, as written by NanoVDB of OpenVDB 9 to 11. NanoVDB's own reader
// trusts the file; this reader checks every offset. A grid is one buffer, whose nodes refer to each other by
// byte offsets. A file contains each grid's buffer as a whole: uncompressed, or compressed by zlib or Blosc.
// The layout of the buffer follows PNanoVDB.h, the library's portable description of it.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "worker/render/bricks/bricks.h"
#include "worker/render/media/vdb_reply.h"

namespace ls::render {

// The readers of .vdb and .nvdb files throw this to reject a file; read_vdb catches it.
struct Refused {
  int code;  // the return value of read_vdb: 1 if the file is at fault, 2 if a limit is exceeded
  std::string text;
};

// The voxels of a grid as a file holds them, and where they are
struct VdbVoxels {
  std::string name;  // of the grid, for messages
  VdbShape shape{};
  VoxelTree tree;
};
// The coordinates of a voxel in a file, and its value: 3 components, of which a grid with one channel uses
// only the first
using Coord = std::array<std::int64_t, 3>;
using Value = std::array<float, 3>;

// Returns the index in `names`, the names of the file's grids, of the grid to read: the one called `wanted`
// or, if `wanted` is empty, the only one, or "density" if there are several. Throws Refused if there is no
// such grid.
std::size_t choose_grid(const std::vector<std::string>& names, const std::string& wanted);

// Sets the sizes of `out` and its tree for the voxels from `lo` to before `end`. Throws Refused if there are
// none, or more than kMaxVdbSide along an axis.
void set_box(const Coord& lo, const Coord& end, VdbVoxels& out);

// The refusal of a grid that takes more than max_bytes.
Refused too_large(const VdbVoxels& grid, std::uint64_t max_bytes);

// True for an .nvdb file, decided by `head`, its first 8 bytes or more.
bool is_nvdb(std::string_view head);

// Returns all bytes of a file. Throws Refused if it has more than 8 GiB or cannot be read.
std::vector<std::byte> file_bytes(const std::filesystem::path& path);

// decode_nvdb() reads the grid `wanted` of the bytes of an .nvdb file like read_vdb(), but reports failure by
// throwing Refused or std::bad_alloc. It finds the grid, decompresses its buffer and calls read_nvdb_grid(),
// which reads the buffer. `name` is the grid's name, for messages.
VdbVoxels decode_nvdb(std::span<const std::byte> file, const std::string& wanted, std::uint64_t max_bytes);
VdbVoxels read_nvdb_grid(const std::string& name, std::span<const std::byte> buffer, std::uint64_t max_bytes);

static_assert(std::endian::native == std::endian::little);

// Access to an untrusted buffer. Every offset is checked; an access beyond the end throws Refused.
class NvdbBytes {
 public:
  NvdbBytes(std::span<const std::byte> data, const char* what) : data_(data), what_(what) {}

  std::uint64_t size() const { return data_.size(); }
  // Returns the n bytes of the buffer from the offset `at` on.
  std::span<const std::byte> part(std::uint64_t at, std::uint64_t n) const {
    if (at > data_.size() || n > data_.size() - at)
      throw Refused{1, "not a readable NanoVDB file: damaged, or cut short: " + std::string(what_) + " of " +
                           std::to_string(data_.size()) + " bytes, of which " + std::to_string(n) +
                           " are wanted from byte " + std::to_string(at) + " on"};
    return data_.subspan(at, n);
  }
  template <class T>
  T get(std::uint64_t at) const {
    T v;
    std::memcpy(&v, part(at, sizeof v).data(), sizeof v);
    return v;
  }
  bool bit(std::uint64_t mask, std::uint32_t i) const {
    return std::to_integer<unsigned>(part(mask + i / 8, 1)[0]) >> i % 8 & 1;
  }

 private:
  std::span<const std::byte> data_;
  const char* what_;
};

}  // namespace ls::render
