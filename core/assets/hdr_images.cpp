// Decodes images with floating-point values without a library: Radiance .hdr and .pfm.
#include <fmt/format.h>

#include <array>
#include <cmath>

#include "core/assets/image.h"
#include "core/base/bytes.h"
#include "core/base/parse_number.h"

namespace ls {

namespace {

constexpr std::size_t kMaxHdrLines = 200;

using Rgbe = std::array<std::uint8_t, 4>;

struct HdrSize {
  std::uint32_t width = 0, height = 0;
};

// Parses "-Y height +X width", which means rows from the top; nullopt for any other orientation, since no
// common program writes one.
std::optional<HdrSize> resolution(std::string_view line) {
  const auto count = [](std::string_view w) -> std::uint32_t {
    const auto n = parse_number<std::uint32_t>(w);
    return n && *n <= kMaxImageSide ? *n : 0;
  };
  HdrSize s;
  if (next_word(line) != "-Y") return std::nullopt;
  s.height = count(next_word(line));
  if (next_word(line) != "+X") return std::nullopt;
  s.width = count(next_word(line));
  if (s.width == 0 || s.height == 0 || std::uint64_t{s.width} * s.height > kMaxImagePixels)
    return std::nullopt;
  return s;
}

// Reads a row as four planes (red, green, blue, exponent), each run-length coded. A length byte above 128
// starts a run: the next byte is repeated length - 128 times. A length byte of up to 128 is followed by that
// number of plain bytes.
bool read_planes(ByteReader& r, std::vector<Rgbe>& row) {
  for (std::size_t plane = 0; plane < 4; ++plane)
    for (std::size_t x = 0; x < row.size();) {
      const auto code = r.take<std::uint8_t>();
      if (!code || *code == 0) return false;
      const bool run = *code > 128;
      const std::size_t n = run ? *code - 128 : *code;
      if (x + n > row.size()) return false;
      std::optional<std::uint8_t> value;
      for (std::size_t i = 0; i < n; ++i) {
        if (!run || i == 0) value = r.take<std::uint8_t>();
        if (!value) return false;
        row[x++][plane] = *value;
      }
    }
  return true;
}

// Reads a row of pixels as they are. A pixel of three ones is none: in the older run-length coding it repeats
// the pixel before it, as often as its exponent says; directly after another such one, 256 times as often.
bool read_pixels(ByteReader& r, Rgbe first, std::vector<Rgbe>& row) {
  unsigned shift = 0;
  for (std::size_t x = 0; x < row.size();) {
    const auto p = x == 0 && shift == 0 ? std::optional(first) : r.take<Rgbe>();
    if (!p) return false;
    if ((*p)[0] != 1 || (*p)[1] != 1 || (*p)[2] != 1) {
      row[x++] = *p;
      shift = 0;
      continue;
    }
    if (x == 0 || shift > 16) return false;
    const std::size_t n = std::size_t{(*p)[3]} << shift;
    if (n > row.size() - x) return false;
    for (std::size_t i = 0; i < n; ++i, ++x) row[x] = row[x - 1];
    shift += 8;
  }
  return true;
}

bool read_row(ByteReader& r, std::vector<Rgbe>& row) {
  const auto first = r.take<Rgbe>();
  if (!first) return false;
  const std::size_t width = row.size();
  if (width >= 8 && width < 32768 && (*first)[0] == 2 && (*first)[1] == 2 && (*first)[2] < 128)
    return std::size_t{(*first)[2]} * 256 + (*first)[3] == width && read_planes(r, row);
  return read_pixels(r, *first, row);
}

// The matrix from CIE XYZ to linear sRGB, whose white is that of Rec. 709 (ITU-R BT.709, IEC 61966-2-1).
constexpr std::array<float, 9> kXyzToSrgb{3.2409699f, -1.5373832f, -0.4986108f, -0.9692436f, 1.8759675f,
                                          0.0415551f, 0.0556301f,  -0.2039770f, 1.0569715f};

// Returns the line without the blanks at its end, such as the carriage return of a file of Windows.
std::string_view trimmed(std::string_view line) { return line.substr(0, line.find_last_not_of(" \t\r") + 1); }

}  // namespace

Result<ImageData> decode_hdr(std::string_view name, std::span<const std::byte> file,
                             std::uint64_t max_pixels) {
  const BrokenImage broken{name, "HDR image"};
  std::string_view text = as_text(file);
  if (!text.starts_with("#?")) return broken("it does not begin with \"#?\"");
  bool rgbe = false, xyze = false, blank = false;
  for (std::size_t i = 0; i < kMaxHdrLines && !blank && !text.empty(); ++i) {
    const std::string_view line = trimmed(next_line(text));
    rgbe |= line == "FORMAT=32-bit_rle_rgbe";
    xyze |= line == "FORMAT=32-bit_rle_xyze";
    blank = line.empty();
  }
  if (!blank || rgbe == xyze)
    return broken("its header does not say that it is a 32-bit_rle_rgbe or 32-bit_rle_xyze image");
  const auto size = resolution(next_line(text));
  if (!size) return broken("its resolution line is not \"-Y height +X width\" of a believable size");
  if (std::uint64_t{size->width} * size->height > max_pixels)
    return too_many_pixels(name, size->width, size->height, max_pixels);
  ByteReader r(file.subspan(file.size() - text.size()));
  // A run packs at most 127 values of a plane into two bytes. So a pixel, which has a value in each of the
  // four planes, takes at least 4 * 2 / 127 bytes, which is more than 1/16 byte. A file that is too short for
  // the claimed size is rejected before memory is allocated.
  if (std::uint64_t{size->width} * size->height / 16 > r.left() || r.left() < std::uint64_t{size->height} * 4)
    return broken("it is too short for its size");
  ImageData image{size->width, size->height, 3, {}, {}, false};
  if (xyze) image.to_srgb = kXyzToSrgb;
  image.f32.reserve(std::uint64_t{size->width} * size->height * 3);
  std::vector<Rgbe> row(size->width);
  for (std::uint32_t y = 0; y < size->height; ++y) {
    if (!read_row(r, row)) return broken(fmt::format("row {} of {} cannot be read", y, size->height));
    for (const Rgbe& p : row) {
      const float scale = p[3] == 0 ? 0 : std::ldexp(1.f, p[3] - 136);
      for (int c = 0; c < 3; ++c) image.f32.push_back(static_cast<float>(p[c]) * scale);
    }
  }
  return image;
}

namespace {

constexpr std::size_t kMaxWord = 40;  // longest number in a header, in characters

// Removes the next word and the one blank after it from the front of `text`, and returns the word.
std::string_view next_field(std::string_view& text) {
  const std::size_t end = text.substr(0, kMaxWord).find_first_of(" \t\r\n");
  if (end == text.npos) return {};
  const std::string_view word = text.substr(0, end);
  text.remove_prefix(end + 1);
  return word;
}

}  // namespace

// Decodes Portable Float Maps: "PF" (colour) or "Pf" (grey), width, height and a scale, each followed by one
// blank, and then float32 values, row by row from the bottom. A negative scale means little endian, a
// positive one big endian; its magnitude is a factor on all values.
Result<ImageData> decode_pfm(std::string_view name, std::span<const std::byte> file,
                             std::uint64_t max_pixels) {
  const BrokenImage broken{name, "PFM image"};
  std::string_view text = as_text(file);
  const std::string_view kind = next_field(text);
  if (kind != "PF" && kind != "Pf") return broken("it does not begin with PF or Pf");
  const auto width = parse_number<std::uint32_t>(next_field(text)),
             height = parse_number<std::uint32_t>(next_field(text));
  const auto scale = parse_number<float>(next_field(text));
  if (!width || !height || *width < 1 || *height < 1 || *width > kMaxImageSide || *height > kMaxImageSide)
    return broken("its header has no believable width and height");
  if (!scale || !std::isnormal(*scale)) return broken("its header has no scale");
  ImageData image{*width, *height, kind == "PF" ? 3u : 1u, {}, {}, false};
  const std::uint64_t pixels = std::uint64_t{*width} * *height, row = std::uint64_t{*width} * image.channels;
  if (pixels > max_pixels) return too_many_pixels(name, *width, *height, max_pixels);
  ByteReader r(file.subspan(file.size() - text.size()));
  if (r.left() / 4 < row * *height) return broken("it is too short for its size");
  image.f32.resize(row * *height);
  for (std::uint64_t y = *height; y-- > 0;)
    for (std::uint64_t i = 0; i < row; ++i)
      image.f32[y * row + i] = *r.take<float>(*scale > 0) * std::abs(*scale);
  return image;
}

}  // namespace ls
