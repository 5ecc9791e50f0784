// Decoders of images with 8 bits per channel that need no library.
#include <fmt/format.h>

#include <array>

#include "core/assets/image.h"
#include "core/base/bytes.h"

namespace ls {
namespace {

Result<void> check_size(const BrokenImage& broken, std::int64_t width, std::int64_t height,
                        std::uint64_t max_pixels) {
  if (width < 1 || height < 1 || width > kMaxImageSide || height > kMaxImageSide)
    return broken(fmt::format("its size is {} x {}", width, height));
  if (static_cast<std::uint64_t>(width * height) <= max_pixels) return {};
  return too_many_pixels(broken.name, static_cast<std::uint64_t>(width), static_cast<std::uint64_t>(height),
                         max_pixels);
}

// Those fields of BMP's two headers (file header and image header) that the decoder uses, in file order.
struct BmpHeader {
  std::uint32_t pixels_at = 0;
  // A positive height means rows from the bottom up, a negative one rows from the top down.
  std::int32_t width = 0, height = 0;
  std::uint16_t bits = 0;
  std::uint32_t compression = 0;
};

std::optional<BmpHeader> read_header(ByteReader& r) {
  if (!r.skip(10)) return std::nullopt;  // skipped: "BM", size of the file, reserved
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

// Decodes Windows bitmaps of the form that painting programs write: 24 or 32 bits per pixel, uncompressed,
// without a palette.
Result<ImageData> decode_bmp(std::string_view name, std::span<const std::byte> file,
                             std::uint64_t max_pixels) {
  const BrokenImage broken{name, "BMP image"};
  ByteReader r(file);
  const auto h = read_header(r);
  if (!h) return broken("its headers are cut off, or older than Windows 3");
  if ((h->bits != 24 && h->bits != 32) || h->compression != 0)
    return bad_argument(
        fmt::format("'{}': a BMP image of {} bits a pixel and compression {}; only plain 24 and 32 "
                    "bits are understood: save it as PNG",
                    name, h->bits, h->compression));
  const std::int64_t width = h->width, height = h->height < 0 ? -std::int64_t{h->height} : h->height;
  if (const auto ok = check_size(broken, width, height, max_pixels); !ok) return tl::unexpected(ok.error());
  ImageData image{static_cast<std::uint32_t>(width), static_cast<std::uint32_t>(height), 3, {}, {}, true};
  const std::uint64_t bytes = h->bits / 8, row = (image.width * bytes + 3) / 4 * 4;
  if (h->pixels_at > file.size() || file.size() - h->pixels_at < row * image.height)
    return broken("it is too short for its size");
  image.u8.reserve(std::size_t{3} * image.width * image.height);
  for (std::uint32_t y = 0; y < image.height; ++y) {
    const std::uint64_t line = h->height < 0 ? y : image.height - 1 - y;
    for (std::uint32_t x = 0; x < image.width; ++x) {
      const auto bgr = file.subspan(h->pixels_at + line * row + x * bytes, 3);
      for (const std::size_t c : {2u, 1u, 0u}) image.u8.push_back(std::to_integer<std::uint8_t>(bgr[c]));
    }
  }
  return image;
}

namespace {

using Rgba = std::array<std::uint8_t, 4>;  // red, green, blue, alpha

constexpr std::uint64_t kLongestRun = 62;  // largest number of pixels in a run, which is stored in one byte

class QoiDecoder {
 public:
  explicit QoiDecoder(ByteReader r) : r_(r) {}

  std::optional<Rgba> next() {
    if (run_ > 0) {
      --run_;
      return now_;
    }
    const auto head = r_.take<std::uint8_t>();
    if (!head || !step(*head)) return std::nullopt;
    seen_[(now_[0] * 3 + now_[1] * 5 + now_[2] * 7 + now_[3] * 11) % 64] = now_;
    return now_;
  }

 private:
  // Decodes one step that begins with the byte `head`: one pixel or a run. Returns false if the data end too
  // early.
  bool step(std::uint8_t head) {
    if (head >= 0xfe) return read_codes(head == 0xff ? 4 : 3);
    const int low = head & 63;
    switch (head >> 6) {
      case 0:
        now_ = seen_[static_cast<std::size_t>(low)];
        return true;
      case 1:
        change((low >> 4) - 2, (low >> 2 & 3) - 2, (low & 3) - 2);
        return true;
      case 2: {
        const auto more = r_.take<std::uint8_t>();
        const int green = low - 32;
        if (more) change(green + (*more >> 4) - 8, green, green + (*more & 15) - 8);
        return more.has_value();
      }
      default:
        run_ = low;  // the current pixel is repeated `low` more times
        return true;
    }
  }
  bool read_codes(std::size_t count) {
    for (std::size_t i = 0; i < count; ++i) {
      const auto code = r_.take<std::uint8_t>();
      if (!code) return false;
      now_[i] = *code;
    }
    return true;
  }
  void change(int red, int green, int blue) {  // the sums wrap around, modulo 256
    now_[0] = static_cast<std::uint8_t>(now_[0] + red);
    now_[1] = static_cast<std::uint8_t>(now_[1] + green);
    now_[2] = static_cast<std::uint8_t>(now_[2] + blue);
  }

  ByteReader r_;
  Rgba now_{0, 0, 0, 255};
  std::array<Rgba, 64> seen_{};
  int run_ = 0;
};

}  // namespace

// Decodes QOI, the "Quite OK Image" format, by its specification 1.0 (qoiformat.org).
Result<ImageData> decode_qoi(std::string_view name, std::span<const std::byte> file,
                             std::uint64_t max_pixels) {
  const BrokenImage broken{name, "QOI image"};
  ByteReader r(file);
  r.skip(4);
  const auto width = r.take<std::uint32_t>(true), height = r.take<std::uint32_t>(true);
  const auto channels = r.take<std::uint8_t>(), space = r.take<std::uint8_t>();
  if (!space || (*channels != 3 && *channels != 4) || *space > 1)
    return broken("its header is cut off or says what no QOI image does");
  if (const auto ok = check_size(broken, *width, *height, max_pixels); !ok) return tl::unexpected(ok.error());
  const std::uint64_t pixels = std::uint64_t{*width} * *height;
  if (pixels / kLongestRun > r.left()) return broken("it is too short for its size");
  ImageData image{*width, *height, *channels, {}, {}, *space == 0};
  image.u8.resize(pixels * *channels);
  QoiDecoder decoder(r);
  for (std::uint64_t i = 0; i < pixels; ++i) {
    const auto codes = decoder.next();
    if (!codes) return broken("it is too short for its size");
    std::copy_n(codes->begin(), *channels, &image.u8[i * *channels]);
  }
  return image;
}

namespace {

enum Kind : std::uint8_t { kMapped = 1, kColour = 2, kGrey = 3 };

struct TgaHeader {
  std::uint8_t kind = 0;
  bool packed = false;  // true if the pixels are run-length coded
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

std::uint32_t little_endian(std::span<const std::byte> b) {
  std::uint32_t x = 0;
  for (std::size_t i = b.size(); i-- > 0;) x = x << 8 | std::to_integer<std::uint32_t>(b[i]);
  return x;
}

// Decodes a colour of 2 bytes (5 bits per channel, 1 bit of alpha), 3 bytes (no alpha) or 4 bytes.
Rgba colour_of(std::span<const std::byte> b) {
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

  // Returns false if the data are certainly too short for this many pixels. A run-length packet has at least
  // 1 + size_ bytes (a header byte and one pixel) and represents at most 128 pixels.
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
  int left_ = 0;  // number of pixels of the current packet that next() has not returned yet
};

std::vector<Rgba> read_map(std::span<const std::byte> bytes, std::size_t entry) {
  std::vector<Rgba> map;
  for (; bytes.size() >= entry; bytes = bytes.subspan(entry)) map.push_back(colour_of(bytes.first(entry)));
  return map;
}

}  // namespace

// Decodes Truevision TGA: true colour, grey or colours of a map, plain or run-length coded, with rows and
// columns in either order.
Result<ImageData> decode_tga(std::string_view name, std::span<const std::byte> file,
                             std::uint64_t max_pixels) {
  const BrokenImage broken{name, "TGA image"};
  ByteReader r(file);
  const auto h = read_tga_header(r);
  if (!h) return broken("its header is cut off or says what no TGA image does");
  if (!is_known(*h))
    return bad_argument(
        fmt::format("'{}': a TGA image of type {} with {} bits a pixel, which is not understood: save "
                    "it as PNG",
                    name, h->kind + (h->packed ? 8 : 0), h->bits));
  if (const auto ok = check_size(broken, h->width, h->height, max_pixels); !ok)
    return tl::unexpected(ok.error());
  const std::uint64_t pixels = std::uint64_t{h->width} * h->height;
  const std::size_t entry = (h->map_bits + 7) / 8, map_at = r.position();
  if (!r.skip(std::uint64_t{h->map_count} * entry)) return broken("its colour map is cut off");
  PixelBytes in(file.subspan(r.position()), (h->bits + 7) / 8, h->packed);
  if (!in.may_suffice(pixels)) return broken("it is too short for its size");
  std::vector<Rgba> map;
  if (h->kind == kMapped) map = read_map(file.subspan(map_at, h->map_count * entry), entry);

  const bool has_alpha = h->has_alpha && (h->kind == kMapped ? h->map_bits : h->bits) % 16 == 0;
  ImageData image{h->width, h->height, h->kind == kGrey ? 1u : has_alpha ? 4u : 3u, {}, {}, true};
  image.u8.resize(pixels * image.channels);
  for (std::uint64_t i = 0; i < pixels; ++i) {
    const auto bytes = in.next();
    if (!bytes) return broken("it is too short for its size");
    Rgba codes{};
    if (h->kind == kColour) codes = colour_of(*bytes);
    if (h->kind == kGrey) codes[0] = std::to_integer<std::uint8_t>((*bytes)[0]);
    if (h->kind == kMapped) {
      const std::uint32_t at = little_endian(*bytes);
      if (at < h->map_first || at - h->map_first >= map.size())
        return broken(fmt::format("a pixel has the colour {}, which its map lacks", at));
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
