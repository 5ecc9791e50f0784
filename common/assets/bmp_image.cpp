// Decodes Windows bitmaps of the form that painting programs write: 24 or 32 bits per pixel, uncompressed,
// without a palette.
#include <fmt/format.h>

#include "common/assets/bytes.h"
#include "common/assets/image.h"

namespace ls {
namespace {

// The fields of the two headers that are used, in the order of the file.
struct BmpHeader {
  std::uint32_t pixels_at = 0;
  // A positive height means rows from the bottom up, a negative one rows from the top down.
  std::int32_t width = 0, height = 0;
  std::uint16_t bits = 0;
  std::uint32_t compression = 0;
};

std::optional<BmpHeader> read_header(ByteReader& r) {
  BmpHeader h;
  // Skipped: "BM", size of the file, reserved.
  if (!r.skip(10)) return std::nullopt;
  const auto at = r.take<std::uint32_t>(), header = r.take<std::uint32_t>();
  if (!at || !header || *header < 40) return std::nullopt;
  const auto width = r.take<std::int32_t>(), height = r.take<std::int32_t>();
  if (!r.skip(2)) return std::nullopt;  // skipped: number of planes
  const auto bits = r.take<std::uint16_t>();
  const auto compression = r.take<std::uint32_t>();
  if (!width || !height || !bits || !compression) return std::nullopt;
  return BmpHeader{*at, *width, *height, *bits, *compression};
}

}  // namespace

Result<ImageData> decode_bmp(std::string_view name, std::span<const std::byte> file,
                             std::uint64_t max_pixels) {
  const auto bad = [&](std::string_view text) {
    return fail(Errc::invalid_argument, fmt::format("'{}': {}", name, text));
  };
  ByteReader r(file);
  const auto h = read_header(r);
  if (!h) return bad("broken BMP image: its headers are cut off, or older than Windows 3");
  if ((h->bits != 24 && h->bits != 32) || h->compression != 0)
    return bad(
        fmt::format("a BMP image of {} bits a pixel and compression {}; only plain 24 and 32 bits are "
                    "understood: save it as PNG",
                    h->bits, h->compression));
  const std::int64_t width = h->width, height = h->height < 0 ? -std::int64_t{h->height} : h->height;
  if (width < 1 || height < 1 || width > kMaxImageSide || height > kMaxImageSide)
    return bad(fmt::format("broken BMP image: its size is {} x {}", width, height));
  const auto pixels = static_cast<std::uint64_t>(width * height);
  if (pixels > max_pixels)
    return too_many_pixels(name, static_cast<std::uint64_t>(width), static_cast<std::uint64_t>(height),
                           max_pixels);
  const std::uint64_t bytes = h->bits / 8, row = (static_cast<std::uint64_t>(width) * bytes + 3) / 4 * 4;
  if (h->pixels_at > file.size() || file.size() - h->pixels_at < row * static_cast<std::uint64_t>(height))
    return bad("broken BMP image: it is too short for its size");
  ImageData image;
  image.width = static_cast<std::uint32_t>(width);
  image.height = static_cast<std::uint32_t>(height);
  image.channels = 3;
  image.srgb = true;
  image.u8.reserve(3 * pixels);
  for (std::uint32_t y = 0; y < image.height; ++y) {
    const std::uint64_t line = h->height < 0 ? y : image.height - 1 - y;
    for (std::uint32_t x = 0; x < image.width; ++x) {
      const auto bgr = file.subspan(h->pixels_at + line * row + x * bytes, 3);
      for (const std::size_t c : {2u, 1u, 0u}) image.u8.push_back(std::to_integer<std::uint8_t>(bgr[c]));
    }
  }
  return image;
}

}  // namespace ls
