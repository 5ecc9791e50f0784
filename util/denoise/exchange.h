// The memory shared with lightshaft-denoise (util/denoise/program/main.cpp): a Header at offset 0, and the
// images from the offset kPlanesAt on. Each image has three planes (colour, albedo, normal) of three floats
// per pixel, row by row. The program overwrites each colour plane with the denoised colours.
#pragma once

#include <cstddef>
#include <cstdint>

namespace ls::denoise {

inline constexpr std::size_t kPlanesAt = 4096;  // offset of the first image, in bytes
inline constexpr std::uint64_t kMagic = 0x6573'696f'6e73'6c;
inline constexpr std::size_t kPlanesPerImage = 3;

enum class Outcome : std::int32_t { none, done, failed };

struct Header {
  std::uint64_t magic;
  // size in pixels, and number of images; 0 images: only the version of the library is requested
  std::int32_t width, height, images;
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
