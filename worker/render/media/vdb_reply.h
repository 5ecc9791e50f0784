// The reply of lightshaft-vdb, written to the file that it inherits as kHelperFd: this header, then the
// grid's values, which start at kVdbValuesAt. Readers must treat the reply as untrusted: a malicious file may
// have determined its content.
#pragma once

#include <cstdint>

#include "worker/render/media/vdb_module.h"

namespace ls::render {

inline constexpr std::uint64_t kVdbValuesAt = 4096;  // offset of the values in bytes
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

}  // namespace ls::render
