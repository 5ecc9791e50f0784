// The interface of lightshaft-vdb, the program that reads .vdb and .nvdb files (vdb_process.h): the function
// that it runs and its reply. It writes the reply to the file that it inherits as kHelperFd: a VdbReply, then
// from kVdbBricksAt on the bricks of each channel (bricks.h): its table, its nodes, its values, each at a
// multiple of 4 bytes. Readers must treat the reply as untrusted: a malicious file may have determined its
// content.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "core/base/error.h"
#include "worker/render/bricks/bricks.h"

namespace ls::render {

// Where a grid's values are
struct VdbShape {
  // Number of nodes (grid points with a value) along x, y and z: the box of the active voxels, enlarged by
  // one layer of nodes on each side
  std::int32_t size[3];
  std::int32_t lead[3];       // by how much the table of the bricks begins before the box (bricks.h)
  double index_to_scene[16];  // 4 x 4 matrix from node (i, j, k) to the scene; row-major
  std::int32_t channels;      // number of values per node: 1 or 3
  std::uint64_t negatives;    // number of negative values, which were set to 0

  Position size_of_box() const { return {size[0], size[1], size[2]}; }
  Position lead_of_box() const { return {lead[0], lead[1], lead[2]}; }
};

struct VdbGrid {
  VdbShape shape{};
  std::vector<OwnBricks> channels;
};

// Reads the grid `grid_name` of the .vdb or .nvdb file `path` into `out`. Linked only into lightshaft-vdb.
// Returns 0 on success, 1 if the file or the grid is at fault, and 2 if a limit is exceeded, such as
// max_bytes, the most memory that the bricks of all channels may take. On failure `error` says why.
int read_vdb(const std::string& path, const std::string& grid_name, std::uint64_t max_bytes, VdbGrid& out,
             std::string& error);

// Stands for "no limit" where a number of bytes is expected.
inline constexpr std::uint64_t kNoDataLimit = ~std::uint64_t{0};
// Offset of the bricks in the reply's file, in bytes
inline constexpr std::uint64_t kVdbBricksAt = 4096;
// The most bytes that padding adds to those of the bricks
inline constexpr std::uint64_t kVdbPadding = 16;
inline constexpr std::uint64_t kVdbMagic = 0x3262'6476'736c;
// The most voxels of a grid along an axis. Index coordinates are float32, which resolve a 1024th of a voxel
// there; macro cells allow for that much.
inline constexpr std::int32_t kMaxVdbSide = 1 << 14;

struct VdbReply {
  std::uint64_t magic;
  std::int32_t code;  // 0, 1 or 2, as returned by read_vdb
  char error[512];    // null-terminated message if code is not 0
  VdbShape shape;
  struct Counts {
    std::uint64_t nodes, bricks;
    std::uint64_t halves;  // 1 if values are halves, else 0
  } counts[3];             // of each channel
};
static_assert(sizeof(VdbReply) <= kVdbBricksAt);

// A grid in a reply, and its bricks there, one for each channel
struct VdbView {
  VdbShape shape{};
  std::vector<BrickTables> channels;
};

// Checks the grid of a reply and returns it. A valid grid has bricks of at most max_bytes that are sound and
// whose values are finite and not negative, sizes of 1 to kMaxVdbSide and a finite transform. The returned
// grid refers to `reply`, which must be page-aligned, as mapped memory is, and must outlive it. Fails with
// invalid_argument if the file is at fault or the reply is malformed, and with resource_exhausted if a limit
// is exceeded.
Result<VdbView> validated_grid(std::span<const std::byte> reply, std::uint64_t max_bytes);

// The error that a caller of lightshaft-vdb reports if its reply is malformed.
tl::unexpected<Error> vdb_nonsense();

}  // namespace ls::render
