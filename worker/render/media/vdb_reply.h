// The interface of lightshaft-vdb, the program that reads .vdb and .nvdb files (vdb_process.h): the function
// that it runs and its reply. It writes the reply to the file that it inherits as kHelperFd: a VdbReply, then
// the grid's values, which start at kVdbValuesAt. Readers must treat the reply as untrusted: a malicious file
// may have determined its content.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "core/base/error.h"

extern "C" {

struct LsVdbGrid {
  // Number of nodes (grid points with a value) along x, y and z: the box of the active voxels, enlarged by
  // one layer of nodes on each side
  std::int32_t size[3];
  double index_to_scene[16];  // 4 x 4 matrix from node (i, j, k) to the scene; row-major
  std::int32_t channels;      // number of values per node: 1 or 3
  float* values;              // x varies fastest, channels are interleaved; freed by ls_vdb_free
  std::uint64_t negatives;    // number of negative values, which were set to 0
};

// Reads the grid `grid_name` of the .vdb or .nvdb file `path` into `out`. Linked only into lightshaft-vdb.
// Its parameters have plain types, so that callers need no headers of OpenVDB. Returns 0 on success, 1 if the
// file or the grid is at fault, and 2 if a limit is exceeded, such as max_values, the largest number of
// values. On failure the buffer `error` of error_size bytes receives a message, which is cut off if it is
// longer.
int ls_vdb_read(const char* path, const char* grid_name, std::uint64_t max_values, LsVdbGrid* out,
                char* error, std::uint64_t error_size);
void ls_vdb_free(LsVdbGrid* grid);
}

namespace ls::render {

// Stands for "no limit" where a number of bytes is expected.
inline constexpr std::uint64_t kNoDataLimit = ~std::uint64_t{0};
// Offset of the grid's values in the reply's file, in bytes
inline constexpr std::uint64_t kVdbValuesAt = 4096;
inline constexpr std::uint64_t kVdbMagic = 0x3162'6476'736c;

struct VdbReply {
  std::uint64_t magic;
  std::int32_t code;  // 0, 1 or 2, as returned by ls_vdb_read
  char error[512];    // null-terminated message if code is not 0
  LsVdbGrid grid;     // its `values` is null; the values are in the file at kVdbValuesAt
};
static_assert(sizeof(VdbReply) <= kVdbValuesAt);

// Returns the number of values of a grid with 1 or 3 channels and sizes of at least 0. For any other grid,
// and on overflow, returns 2^64 - 1.
inline std::uint64_t values_of(const LsVdbGrid& grid) {
  if (grid.channels != 1 && grid.channels != 3) return ~std::uint64_t{0};
  auto count = static_cast<std::uint64_t>(grid.channels);
  for (const std::int32_t n : grid.size)
    if (n < 0 || __builtin_mul_overflow(count, static_cast<std::uint64_t>(n), &count))
      return ~std::uint64_t{0};
  return count;
}

// Checks the grid of a reply and returns it. A valid grid has at most max_values values, all finite and not
// negative, sizes of at least 1 and a finite transform. The returned grid points at its values in `reply`,
// which must be page-aligned, as mapped memory is, and must outlive the grid. Fails with invalid_argument if
// the file is at fault or the reply is malformed, and with resource_exhausted if a limit is exceeded.
Result<LsVdbGrid> validated_grid(std::span<const std::byte> reply, std::uint64_t max_values);

// The error that a caller of lightshaft-vdb reports if its reply is malformed.
tl::unexpected<Error> vdb_nonsense();

}  // namespace ls::render
