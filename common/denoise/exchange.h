// The memory shared with lightshaft-denoise (common/denoise/program/main.cpp): a header, and from the offset
// kPlanesAt on the images. Each image has three planes (colour, albedo, normal) of three floats per pixel,
// row by row. The program overwrites each colour with the denoised one.
#pragma once

#include <cstddef>
#include <cstdint>

namespace ls::denoise {

inline constexpr std::size_t kPlanesAt = 4096;  // offset of the images in bytes
inline constexpr std::uint64_t kMagic = 0x6573'696f'6e73'6c;
inline constexpr std::size_t kPlanesPerImage = 3;

enum class Outcome : std::int32_t { none, done, failed };

struct Header {
  std::uint64_t magic;
  std::int32_t width, height, images;  // 0 images: only the version of the library is requested
  Outcome outcome;
  std::int32_t version;  // version of the library, 20501 for 2.5.1; 0: it was not found
  char error[512];       // null-terminated
};
static_assert(sizeof(Header) <= kPlanesAt);

inline std::size_t plane_floats(std::int32_t width, std::int32_t height) {
  return std::size_t{3} * static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
}
inline std::size_t shared_bytes(std::int32_t width, std::int32_t height, std::int32_t images) {
  return kPlanesAt +
         static_cast<std::size_t>(images) * kPlanesPerImage * plane_floats(width, height) * sizeof(float);
}

}  // namespace ls::denoise
