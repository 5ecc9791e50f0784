#include "common/image/exr/attribute.h"

#include <algorithm>
#include <cstdint>
#include <iterator>

#include "common/image/exr/byte_cursor.h"

namespace ls::exr {
namespace {

struct Fixed {
  std::string_view type;
  std::size_t bytes;
};
constexpr Fixed kFixed[] = {{"box2i", 16},
                            {"box2f", 16},
                            {"chromaticities", 32},
                            {"compression", 1},
                            {"deepImageState", 1},
                            {"double", 8},
                            {"envmap", 1},
                            {"float", 4},
                            {"int", 4},
                            {"keycode", 28},
                            {"lineOrder", 1},
                            {"m33f", 36},
                            {"m33d", 72},
                            {"m44f", 64},
                            {"m44d", 128},
                            {"rational", 8},
                            {"tiledesc", 9},
                            {"timecode", 8},
                            {"v2i", 8},
                            {"v2f", 8},
                            {"v2d", 16},
                            {"v3i", 12},
                            {"v3f", 12},
                            {"v3d", 24}};

// Checks a list of channels: each a name followed by 16 bytes, and an empty name at the end.
bool channel_list(ByteCursor in) {
  constexpr std::size_t kMaxNameBytes = 255;
  while (const auto name = in.name(kMaxNameBytes)) {
    if (name->empty()) return in.left() == 0;
    if (!in.take(16)) return false;
  }
  return false;
}

// Checks a list of strings, each preceded by its length.
bool strings(ByteCursor in) {
  while (in.left() > 0) {
    const auto length = in.value<std::int32_t>();
    if (!length || *length < 0 || !in.take(static_cast<std::size_t>(*length))) return false;
  }
  return true;
}

// Checks a preview: width, height, and four bytes per pixel.
bool preview(ByteCursor in) {
  const auto width = in.value<std::uint32_t>(), height = in.value<std::uint32_t>();
  return width && height && std::uint64_t{*width} * *height <= in.left() / 4 &&
         std::uint64_t{*width} * *height * 4 == in.left();
}

}  // namespace

bool fills_its_size(std::string_view type, std::span<const std::byte> value) {
  const auto* fixed =
      std::find_if(std::begin(kFixed), std::end(kFixed), [&](const Fixed& f) { return f.type == type; });
  if (fixed != std::end(kFixed)) return value.size() == fixed->bytes;
  if (type == "chlist") return channel_list(ByteCursor(value));
  if (type == "stringvector") return strings(ByteCursor(value));
  if (type == "preview") return preview(ByteCursor(value));
  if (type == "floatvector") return value.size() % 4 == 0;
  return true;
}

}  // namespace ls::exr
