#include "core/image/exr/memory.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <iterator>
#include <optional>

#include "core/base/bytes.h"
#include "core/base/safe_text.h"

namespace ls::exr {
namespace {

constexpr std::uint32_t kMagic = 20000630, kTiledFlag = 0x200, kMultiPartFlag = 0x1000;
constexpr std::size_t kMaxNameBytes = 255;
constexpr std::uint64_t kMaxChunkBytes = std::uint64_t{1} << 30;
constexpr int kMaxParts = 256;
// The library allocates the buffers of a chunk (a tile or a block of lines) before it reads the chunk. So for
// a chunk of more than kFreeChunkBytes the file must be long enough: at least the chunk's size divided by
// kMostPacking. No compression of the format packs more than a few thousand bytes into one (deflate: 1032).
constexpr std::uint64_t kFreeChunkBytes = std::uint64_t{64} << 20;
constexpr double kMostPacking = 4096;
// Size of the smallest entry of a channel list: a name of one letter, the terminating zero, four int32.
constexpr std::size_t kLeastChannelBytes = 18;

struct Part {
  std::optional<std::int64_t> width, height;
  std::int64_t lines_per_chunk = 1;
  std::size_t channels = 0;  // upper bound of the number of channels
  std::uint32_t tile_width = 0, tile_height = 0;
  std::int32_t chunk_count = 0;
};

// Lines per chunk for each compression. The index is the number of the compression in the format: none, RLE,
// ZIPS, ZIP, PIZ, PXR24, B44, B44A, DWAA, DWAB.
constexpr std::int64_t kLines[] = {1, 1, 1, 16, 32, 16, 32, 32, 32, 256};

void note(std::string_view name, std::span<const std::byte> raw, Part& part) {
  ByteReader in(raw);
  if (name == "dataWindow" && raw.size() == 16) {
    const std::int64_t x0 = *in.take<std::int32_t>(), y0 = *in.take<std::int32_t>(),
                       x1 = *in.take<std::int32_t>(), y1 = *in.take<std::int32_t>();
    part.width = x1 - x0 + 1;
    part.height = y1 - y0 + 1;
  } else if (name == "compression" && raw.size() == 1) {
    const auto kind = static_cast<std::size_t>(raw[0]);
    part.lines_per_chunk = kind < std::size(kLines) ? kLines[kind] : 256;
  } else if (name == "channels") {
    part.channels = raw.size() / kLeastChannelBytes;
  } else if (name == "tiles" && raw.size() == 9) {
    part.tile_width = *in.take<std::uint32_t>();
    part.tile_height = *in.take<std::uint32_t>();
  } else if (name == "chunkCount" && raw.size() == 4) {
    part.chunk_count = *in.take<std::int32_t>();
  }
}

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

// Checks a list of channels. Each channel is a name followed by 16 bytes; an empty name ends the list.
bool channel_list(ByteReader in) {
  while (const auto name = in.name(kMaxNameBytes)) {
    if (name->empty()) return in.left() == 0;
    if (!in.bytes(16)) return false;
  }
  return false;
}

// Checks a list of strings, each preceded by its length.
bool strings(ByteReader in) {
  while (in.left() > 0) {
    const auto length = in.take<std::int32_t>();
    if (!length || *length < 0 || !in.bytes(static_cast<std::size_t>(*length))) return false;
  }
  return true;
}

// Checks a preview image: width, height, and four bytes per pixel.
bool preview(ByteReader in) {
  const auto width = in.take<std::uint32_t>(), height = in.take<std::uint32_t>();
  return width && height && std::uint64_t{*width} * *height <= in.left() / 4 &&
         std::uint64_t{*width} * *height * 4 == in.left();
}

// Checks whether an attribute's value has the size that its type requires. For most types the library ignores
// the size in the header and reads as many bytes as the type or the contents require. If the two sizes
// disagree, the library continues at a wrong position, where any four bytes may become the size of a buffer
// to allocate. Unknown types are always accepted, since the library only copies their bytes.
bool fills_its_size(std::string_view type, std::span<const std::byte> value) {
  const auto* fixed =
      std::find_if(std::begin(kFixed), std::end(kFixed), [&](const Fixed& f) { return f.type == type; });
  if (fixed != std::end(kFixed)) return value.size() == fixed->bytes;
  if (type == "chlist") return channel_list(ByteReader(value));
  if (type == "stringvector") return strings(ByteReader(value));
  if (type == "preview") return preview(ByteReader(value));
  if (type == "floatvector") return value.size() % 4 == 0;
  return true;
}

class Scan {
 public:
  Scan(std::span<const std::byte> file, const std::string& name, const ExrLimits& limits)
      : in_(file), file_bytes_(file.size()), name_(name), limits_(limits) {}

  Result<void> run() {
    const auto magic = in_.take<std::uint32_t>(), version = in_.take<std::uint32_t>();
    if (!magic || !version || *magic != kMagic) return refuse("not an EXR file");
    tiled_ = *version & kTiledFlag;
    const bool many = *version & kMultiPartFlag;
    for (int p = 0;; ++p) {
      if (p > kMaxParts) return refuse(fmt::format("more than {} parts", kMaxParts));
      const auto part = read_part(many);
      if (!part) return tl::unexpected(part.error());
      if (!*part) return {};  // an empty header follows the last part
      if (const auto ok = check(**part); !ok) return ok;
      if (!many) return {};
    }
  }

 private:
  tl::unexpected<Error> refuse(const std::string& what, Errc code = Errc::invalid_argument) const {
    return fail(code, fmt::format("{}: cannot read this EXR: {}", name_, what));
  }

  Result<std::optional<Part>> read_part(bool many) {
    Part part;
    for (bool first = true;; first = false) {
      const auto name = in_.name(kMaxNameBytes);
      if (!name) return refuse("its header is cut off");
      if (name->empty()) {
        if (first && many) return std::optional<Part>{};
        return std::optional<Part>(part);
      }
      const auto type = in_.name(kMaxNameBytes);
      const auto size = in_.take<std::int32_t>();
      if (!type || !size || *size < 0) return refuse("its header is cut off or damaged");
      const auto raw = in_.bytes(static_cast<std::size_t>(*size));
      if (!raw) return refuse(fmt::format("the header claims {} bytes, more than the file has", *size));
      if (!fills_its_size(*type, *raw))
        return refuse(fmt::format("its attribute '{}' is not as long as the header says", plain_text(*name)));
      note(*name, *raw, part);
    }
  }

  Result<void> check(const Part& part) const {
    if (!part.width || !part.height) return refuse("a part has no data window");
    const std::int64_t w = *part.width, h = *part.height;
    if (w < 1 || h < 1) return refuse("the image is empty");
    if (w > limits_.max_side || h > limits_.max_side ||
        static_cast<std::uint64_t>(w * h) > limits_.max_pixels)
      return refuse(fmt::format("{} x {} pixels; the limits are {} a side and {} in all", w, h,
                                limits_.max_side, limits_.max_pixels),
                    Errc::resource_exhausted);
    const bool tiles = tiled_ || part.tile_width || part.tile_height;
    if (tiles && (part.tile_width < 1 || part.tile_height < 1)) return refuse("its tiles have no size");
    const auto up = [](std::int64_t n, std::int64_t d) {
      return static_cast<std::uint64_t>((n + d - 1) / d);
    };
    const std::uint64_t chunks =
        tiles ? up(w, part.tile_width) * up(h, part.tile_height) : up(h, part.lines_per_chunk);
    // The chunk table has 8 bytes per chunk. Only the chunks of the full resolution are counted; if the file
    // has further mip levels, the table is even longer.
    if (chunks > in_.left() / 8 || part.chunk_count < 0 ||
        static_cast<std::uint64_t>(part.chunk_count) > in_.left() / 8)
      return refuse(fmt::format("the file ends too early for {} x {} pixels", w, h));
    const double chunk_pixels = tiles ? static_cast<double>(part.tile_width) * part.tile_height
                                      : static_cast<double>(w) * static_cast<double>(part.lines_per_chunk);
    const double bytes = chunk_pixels * 4 * static_cast<double>(part.channels);
    if (bytes > static_cast<double>(kMaxChunkBytes))
      return refuse(
          fmt::format("one of its tiles or blocks of lines needs more than {} bytes", kMaxChunkBytes),
          Errc::resource_exhausted);
    if (bytes > static_cast<double>(kFreeChunkBytes) &&
        bytes > kMostPacking * static_cast<double>(file_bytes_))
      return refuse(
          fmt::format("one of its tiles or blocks of lines needs {:.0f} bytes, more than {} can hold packed",
                      bytes, file_bytes_));
    return {};
  }

  ByteReader in_;
  const std::size_t file_bytes_;
  const std::string& name_;
  const ExrLimits& limits_;
  bool tiled_ = false;
};

}  // namespace

Result<void> check_headers(std::span<const std::byte> file, const std::string& name,
                           const ExrLimits& limits) {
  return Scan(file, name, limits).run();
}

}  // namespace ls::exr
