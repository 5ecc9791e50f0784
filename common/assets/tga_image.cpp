// Decodes Truevision TGA: true colour, grey or colours of a map, plain or run-length coded, with rows and
// columns in either order.
#include <fmt/format.h>

#include <array>

#include "common/assets/bytes.h"
#include "common/assets/image.h"

namespace ls {
namespace {

enum Kind : std::uint8_t { kMapped = 1, kColour = 2, kGrey = 3 };

struct TgaHeader {
  std::uint8_t kind = 0;
  bool packed = false;  // run-length coded
  std::uint32_t map_first = 0, map_count = 0, map_bits = 0;
  std::uint32_t width = 0, height = 0, bits = 0;
  bool has_alpha = false, from_right = false, from_top = false;
};

std::optional<TgaHeader> read_tga_header(ByteReader& r) {
  const auto id = r.take<std::uint8_t>(), map = r.take<std::uint8_t>(), type = r.take<std::uint8_t>();
  const auto map_first = r.take<std::uint16_t>(), map_count = r.take<std::uint16_t>();
  const auto map_bits = r.take<std::uint8_t>();
  if (!map_bits || !r.skip(4)) return std::nullopt;  // skipped: position of the image on a screen
  const auto width = r.take<std::uint16_t>(), height = r.take<std::uint16_t>();
  const auto bits = r.take<std::uint8_t>(), order = r.take<std::uint8_t>();
  if (!order || *map > 1 || (*order & 0xc0) != 0) return std::nullopt;  // interleaved rows are rejected
  if (!r.skip(*id)) return std::nullopt;
  TgaHeader h;
  h.kind = *type & 7;
  h.packed = *type & 8;
  if (*map == 1) h.map_first = *map_first, h.map_count = *map_count, h.map_bits = *map_bits;
  h.width = *width, h.height = *height, h.bits = *bits;
  h.has_alpha = *order & 0x0f, h.from_right = *order & 0x10, h.from_top = *order & 0x20;
  return (*type & ~15) == 0 ? std::optional(h) : std::nullopt;
}

bool is_colour(std::uint32_t bits) { return bits == 15 || bits == 16 || bits == 24 || bits == 32; }

bool is_known(const TgaHeader& h) {
  if (h.kind == kMapped) return (h.bits == 8 || h.bits == 16) && is_colour(h.map_bits);
  return h.kind == kColour ? is_colour(h.bits) : h.kind == kGrey && h.bits == 8;
}

using Codes = std::array<std::uint8_t, 4>;  // red, green, blue, alpha

std::uint32_t little_endian(std::span<const std::byte> b) {
  std::uint32_t x = 0;
  for (std::size_t i = b.size(); i-- > 0;) x = x << 8 | std::to_integer<std::uint32_t>(b[i]);
  return x;
}

// Decodes a colour of 2 bytes (5 bits per channel, 1 bit of alpha), 3 bytes (no alpha) or 4 bytes.
Codes colour_of(std::span<const std::byte> b) {
  const std::uint32_t x = little_endian(b);
  const auto code = [](std::uint32_t v) { return static_cast<std::uint8_t>(v); };
  if (b.size() > 2) return {code(x >> 16), code(x >> 8), code(x), code(b.size() == 4 ? x >> 24 : 255)};
  const auto of_five = [&](int shift) { return code(((x >> shift & 31) * 255 + 15) / 31); };
  return {of_five(10), of_five(5), of_five(0), code(x & 0x8000 ? 255 : 0)};
}

// Iterates over the pixels in the file: next() returns the bytes of one pixel after another.
class PixelBytes {
 public:
  PixelBytes(std::span<const std::byte> data, std::size_t size, bool packed)
      : data_(data), size_(size), packed_(packed) {}

  // Returns false if the data are certainly too short for `pixels`: a run-length packet has at least 1 + size
  // bytes and at most 128 pixels.
  bool may_suffice(std::uint64_t pixels) const {
    return data_.size() >= (packed_ ? (pixels + 127) / 128 * (1 + size_) : pixels * size_);
  }

  std::optional<std::span<const std::byte>> next() {
    if (packed_ && left_ == 0) {
      if (data_.empty()) return std::nullopt;
      const auto head = std::to_integer<std::uint8_t>(data_[0]);
      data_ = data_.subspan(1);
      repeats_ = head & 0x80;
      left_ = (head & 0x7f) + 1;
    }
    if (data_.size() < size_) return std::nullopt;
    const auto pixel = data_.first(size_);
    if (packed_) --left_;
    if (!packed_ || !repeats_ || left_ == 0) data_ = data_.subspan(size_);
    return pixel;
  }

 private:
  std::span<const std::byte> data_;
  std::size_t size_;
  bool packed_, repeats_ = false;
  int left_ = 0;  // pixels of the current packet
};

std::vector<Codes> read_map(std::span<const std::byte> bytes, std::size_t entry) {
  std::vector<Codes> map;
  for (; bytes.size() >= entry; bytes = bytes.subspan(entry)) map.push_back(colour_of(bytes.first(entry)));
  return map;
}

}  // namespace

Result<ImageData> decode_tga(std::string_view name, std::span<const std::byte> file,
                             std::uint64_t max_pixels) {
  const auto bad = [&](std::string_view text) {
    return fail(Errc::invalid_argument, fmt::format("'{}': {}", name, text));
  };
  ByteReader r(file);
  const auto h = read_tga_header(r);
  if (!h) return bad("broken TGA image: its header is cut off or says what no TGA image does");
  if (!is_known(*h))
    return bad(
        fmt::format("a TGA image of type {} with {} bits a pixel, which is not understood: save it as PNG",
                    h->kind + (h->packed ? 8 : 0), h->bits));
  if (h->width < 1 || h->height < 1 || h->width > kMaxImageSide || h->height > kMaxImageSide)
    return bad(fmt::format("broken TGA image: its size is {} x {}", h->width, h->height));
  const std::uint64_t pixels = std::uint64_t{h->width} * h->height;
  if (pixels > max_pixels) return too_many_pixels(name, h->width, h->height, max_pixels);
  const std::size_t entry = (h->map_bits + 7) / 8, map_at = r.position();
  if (!r.skip(std::uint64_t{h->map_count} * entry)) return bad("broken TGA image: its colour map is cut off");
  PixelBytes in(file.subspan(r.position()), (h->bits + 7) / 8, h->packed);
  if (!in.may_suffice(pixels)) return bad("broken TGA image: it is too short for its size");
  std::vector<Codes> map;
  if (h->kind == kMapped) map = read_map(file.subspan(map_at, h->map_count * entry), entry);

  const bool has_alpha = h->has_alpha && (h->kind == kMapped ? h->map_bits : h->bits) % 16 == 0;
  ImageData image{h->width, h->height, h->kind == kGrey ? 1u : has_alpha ? 4u : 3u, {}, {}, true};
  image.u8.resize(pixels * image.channels);
  for (std::uint64_t i = 0; i < pixels; ++i) {
    const auto bytes = in.next();
    if (!bytes) return bad("broken TGA image: it is too short for its size");
    Codes codes{};
    if (h->kind == kColour) codes = colour_of(*bytes);
    if (h->kind == kGrey) codes[0] = std::to_integer<std::uint8_t>((*bytes)[0]);
    if (h->kind == kMapped) {
      const std::uint32_t at = little_endian(*bytes);
      if (at < h->map_first || at - h->map_first >= map.size())
        return bad(fmt::format("broken TGA image: a pixel has the colour {}, which its map lacks", at));
      codes = map[at - h->map_first];
    }
    const std::uint64_t column = i % h->width, row = i / h->width;
    const std::uint64_t x = h->from_right ? h->width - 1 - column : column,
                        y = h->from_top ? row : h->height - 1 - row;
    std::copy_n(codes.begin(), image.channels, &image.u8[(y * h->width + x) * image.channels]);
  }
  return image;
}

}  // namespace ls
