// The interface of lightshaft-vdb, the program that reads .vdb and .nvdb files (vdb_process.h): the function
// that it runs and its reply. It writes the reply to the file that it inherits as kHelperFd: a VdbReply, then
// the grid's values, which start at kVdbValuesAt. Readers must treat the reply as untrusted: a malicious file
// may have determined its content.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "common/base/error.h"

extern "C" {

struct LsVdbGrid {
  // Number of nodes, including one layer of background nodes around the active voxels
  std::int32_t size[3];
  double index_to_scene[16];  // maps the node (i, j, k) to the scene; row-major, for column vectors
  std::int32_t channels;      // 1 or 3 channels
  float* values;              // channels interleaved, x fastest; freed by ls_vdb_free
  std::uint64_t negatives;    // number of negative values, which were set to 0
};

// Reads the grid `grid_name` of the file `path`, which may be of either kind. Linked only into
// lightshaft-vdb. It has plain types only, so that users need no headers of OpenVDB. Returns 0 on success, 1
// if the file or the grid is at fault, and 2 if a limit is exceeded, such as max_values, the largest number
// of values. `error` receives a message of at most error_size bytes.
int ls_vdb_read(const char* path, const char* grid_name, std::uint64_t max_values, LsVdbGrid* out,
                char* error, std::uint64_t error_size);
void ls_vdb_free(LsVdbGrid* grid);
}

namespace ls::render {

inline constexpr std::uint64_t kNoDataLimit = ~std::uint64_t{0};  // lightshaft-vdb may use any memory
inline constexpr std::uint64_t kVdbValuesAt = 4096;               // offset of the values in bytes
inline constexpr std::uint64_t kVdbMagic = 0x3162'6476'736c;

struct VdbReply {
  std::uint64_t magic;
  std::int32_t code;  // return value of ls_vdb_read
  char error[512];    // null-terminated
  LsVdbGrid grid;     // without `values`
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
// negative, sizes of at least 1 and a finite transform. Its values stay where they are in `reply`, which must
// be page-aligned, as mapped memory is. Fails with invalid_argument if the file is at fault or the reply is
// malformed, and with resource_exhausted if a limit is exceeded.
Result<LsVdbGrid> validated_grid(std::span<const std::byte> reply, std::uint64_t max_values);

// The error that the caller reports for a malformed reply.
tl::unexpected<Error> vdb_nonsense();

}  // namespace ls::render
