#include <fmt/format.h>

#include <array>
#include <cmath>

#include "common/assets/bytes.h"
#include "common/assets/image.h"
#include "common/base/parse_number.h"

namespace ls {

namespace {

constexpr std::size_t kMaxHdrLines = 200;

using Rgbe = std::array<std::uint8_t, 4>;

struct HdrSize {
  std::uint32_t width = 0, height = 0;
};

// Parses "-Y height +X width", which means rows from the top. Programs do not write other orientations.
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

bool read_row(ByteReader& r, std::vector<Rgbe>& row) {
  const auto first = r.take<Rgbe>();
  if (!first) return false;
  const std::size_t width = row.size();
  if (width >= 8 && width < 32768 && (*first)[0] == 2 && (*first)[1] == 2 && (*first)[2] < 128)
    return std::size_t{(*first)[2]} * 256 + (*first)[3] == width && read_planes(r, row);
  row[0] = *first;
  for (std::size_t x = 1; x < width; ++x) {
    const auto p = r.take<Rgbe>();
    if (!p) return false;
    row[x] = *p;
  }
  return true;
}

}  // namespace

Result<ImageData> decode_hdr(std::string_view name, std::span<const std::byte> file,
                             std::uint64_t max_pixels) {
  const auto bad = [&](std::string_view text) {
    return fail(Errc::invalid_argument, fmt::format("'{}': broken HDR image: {}", name, text));
  };
  std::string_view text = as_text(file);
  if (!text.starts_with("#?")) return bad("it does not begin with \"#?\"");
  bool rgbe = false, blank = false;
  for (std::size_t i = 0; i < kMaxHdrLines && !blank && !text.empty(); ++i) {
    const std::string_view line = next_line(text);
    rgbe |= line == "FORMAT=32-bit_rle_rgbe";
    blank = line.empty();
  }
  if (!blank || !rgbe) return bad("its header is not that of a 32-bit_rle_rgbe image");
  const auto size = resolution(next_line(text));
  if (!size) return bad("its resolution line is not \"-Y height +X width\" of a believable size");
  if (std::uint64_t{size->width} * size->height > max_pixels)
    return too_many_pixels(name, size->width, size->height, max_pixels);
  ByteReader r(file.subspan(file.size() - text.size()));
  // A run packs at most 127 values of a plane into two bytes, so a pixel of four planes takes more than 1/16
  // byte. A file that is too short for the claimed size is rejected before memory is allocated.
  if (std::uint64_t{size->width} * size->height / 16 > r.left() || r.left() < std::uint64_t{size->height} * 4)
    return bad("it is too short for its size");
  ImageData image{size->width, size->height, 3, {}, {}, false};
  image.f32.reserve(std::uint64_t{size->width} * size->height * 3);
  std::vector<Rgbe> row(size->width);
  for (std::uint32_t y = 0; y < size->height; ++y) {
    if (!read_row(r, row)) return bad(fmt::format("row {} of {} cannot be read", y, size->height));
    for (const Rgbe& p : row) {
      const float scale = p[3] == 0 ? 0 : std::ldexp(1.f, p[3] - 136);
      for (int c = 0; c < 3; ++c) image.f32.push_back(static_cast<float>(p[c]) * scale);
    }
  }
  return image;
}

}  // namespace ls
