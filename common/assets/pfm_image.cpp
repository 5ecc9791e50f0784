// Decodes Portable Float Maps: "PF" (colour) or "Pf" (grey), width, height and a scale, each followed by one
// blank, and then float32 values, row by row from the bottom. A negative scale means little endian, a
// positive one big endian; its magnitude is a factor on all values.
#include <fmt/format.h>

#include <cmath>

#include "common/assets/bytes.h"
#include "common/assets/image.h"
#include "common/base/parse_number.h"

namespace ls {
namespace {

constexpr std::size_t kMaxWord = 40;  // longest number in a header

// Removes the next word and the one blank after it from the front of `text`, and returns the word.
std::string_view next_field(std::string_view& text) {
  const std::size_t end = text.substr(0, kMaxWord).find_first_of(" \t\r\n");
  if (end == text.npos) return {};
  const std::string_view word = text.substr(0, end);
  text.remove_prefix(end + 1);
  return word;
}

}  // namespace

Result<ImageData> decode_pfm(std::string_view name, std::span<const std::byte> file,
                             std::uint64_t max_pixels) {
  const auto bad = [&](std::string_view text) {
    return fail(Errc::invalid_argument, fmt::format("'{}': broken PFM image: {}", name, text));
  };
  std::string_view text = as_text(file);
  const std::string_view kind = next_field(text);
  if (kind != "PF" && kind != "Pf") return bad("it does not begin with PF or Pf");
  const auto width = parse_number<std::uint32_t>(next_field(text)),
             height = parse_number<std::uint32_t>(next_field(text));
  const auto scale = parse_number<float>(next_field(text));
  if (!width || !height || *width < 1 || *height < 1 || *width > kMaxImageSide || *height > kMaxImageSide)
    return bad("its header has no believable width and height");
  if (!scale || !std::isnormal(*scale)) return bad("its header has no scale");
  ImageData image{*width, *height, kind == "PF" ? 3u : 1u, {}, {}, false};
  const std::uint64_t pixels = std::uint64_t{*width} * *height, row = std::uint64_t{*width} * image.channels;
  if (pixels > max_pixels) return too_many_pixels(name, *width, *height, max_pixels);
  ByteReader r(file.subspan(file.size() - text.size()));
  if (r.left() / 4 < row * *height) return bad("it is too short for its size");
  image.f32.resize(row * *height);
  for (std::uint64_t y = *height; y-- > 0;)
    for (std::uint64_t i = 0; i < row; ++i)
      image.f32[y * row + i] = *r.take<float>(*scale > 0) * std::abs(*scale);
  return image;
}

}  // namespace ls
