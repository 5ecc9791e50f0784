// The memory shared with lightshaft-exr (worker/reference/main.cpp), which decodes a reference image: a
// Header at offset 0, the bytes of the EXR file from kExrAt on, and from values_at() on the result: R, G, B
// of each pixel, row by row, and then the standard errors of these values.
#pragma once

#include <cstddef>
#include <cstdint>

namespace ls::reference {

inline constexpr std::uint64_t kMagic = 0x7272'7865'6873'6c;
inline constexpr std::size_t kExrAt = 4096;

enum class Outcome : std::int32_t { none, done, refused };

struct Header {
  std::uint64_t magic;
  std::uint64_t exr_bytes, max_bytes, max_pixels;  // of the file, and ExrLimits
  std::int32_t width, height;                      // size that the image must have
  // Set by the program:
  Outcome outcome;
  std::int32_t code;         // if refused: an Errc
  std::int32_t has_error;    // 1: the file has standard errors
  char scene[80], seed[32];  // ReferenceOrigin, null-terminated; empty if longer
  char error[1024];          // if refused: why, null-terminated
};
static_assert(sizeof(Header) <= kExrAt);

inline std::size_t floats_of(std::int32_t width, std::int32_t height) {
  return std::size_t{3} * static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
}
inline std::size_t values_at(std::uint64_t exr_bytes) {
  return (kExrAt + static_cast<std::size_t>(exr_bytes) + 63) / 64 * 64;
}
inline std::size_t shared_bytes(std::uint64_t exr_bytes, std::int32_t width, std::int32_t height) {
  return values_at(exr_bytes) + 2 * floats_of(width, height) * sizeof(float);
}

}  // namespace ls::reference
