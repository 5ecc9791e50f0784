// Encodes and decodes partials: EXR files with the pixel sums of one tile and range of samples. They are
// encoded with OpenEXR, but decoded without it. Partials come from untrusted workers and have exactly one
// form: uncompressed scanlines of known float channels under a known header. So they are parsed byte by byte
// against that form, instead of by a library that accepts every EXR. Memory is allocated only after the sizes
// in the file have been compared with those of the tile.
#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfOutputFile.h>
#include <ImfStringAttribute.h>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstring>
#include <optional>
#include <string_view>

#include "core/base/bytes.h"
#include "core/image/aov/identifiers.h"
#include "core/image/exr/memory.h"
#include "core/image/film/partial.h"
#include "core/image/frame/render_limits.h"

namespace ls {
namespace {

constexpr char kUnitAttribute[] = "lightshaft:unit";
// The names of the colour channels, in the order of the planes in memory. In a file the channels are sorted
// by name: the file's channel i is plane kFileOrder[i] in memory. The AOV channels follow the colour
// channels; their order is the same in memory and in the file.
constexpr std::array<const char*, kPartialChannels> kPartialChannelNames = {"A.R", "A.G", "A.B",
                                                                            "B.R", "B.G", "B.B"};
constexpr std::array<int, kPartialChannels> kFileOrder = {2, 1, 0, 5, 4, 3};
constexpr std::int64_t kMaxPartialPixels = 256 * 256;  // number of pixels of the largest tile

constexpr std::int32_t kMaxUnitJson = 1024;
// upper limit of the size of the channel list, in bytes; all AOVs together need about 2700, and the light
// groups up to 47 for each of 2 x 6 x kMostLightGroups channels, and slices 26 for each of
// 5 x (kMostDeepSlices + 1)
constexpr std::int32_t kMaxChannelList = 49152;
// longest name, unless the file has the flag for long names, which partials never have
constexpr std::size_t kMaxNameBytes = 31;

tl::unexpected<Error> refuse_partial(std::string what) {
  return bad_argument("partial EXR: " + std::move(what));
}

struct Shape {
  std::optional<PixelRect> data, display;
  std::optional<std::string_view> unit;
  std::size_t pixels_at = 0;  // offset in the file of the table of line offsets, in bytes
  AovSet aovs;                // AOVs of which the file has at least one channel
};

struct Attribute {
  std::string_view name, type;
  std::int32_t size;  // size of the value in bytes; 0: any size is allowed
};
constexpr Attribute kAttributes[] = {
    {"channels", "chlist", 0},        {"compression", "compression", 1}, {"dataWindow", "box2i", 16},
    {"displayWindow", "box2i", 16},   {"lineOrder", "lineOrder", 1},     {"pixelAspectRatio", "float", 4},
    {"screenWindowCenter", "v2f", 8}, {"screenWindowWidth", "float", 4}, {kUnitAttribute, "string", 0},
};

Result<void> check_magic(ByteReader& in) {
  const auto magic = in.take<std::uint32_t>(), version = in.take<std::uint32_t>();
  if (!magic || !version) return refuse_partial("the file ends in its first 8 bytes");
  if (*magic != 20000630u) return refuse_partial("not an EXR file (wrong magic number)");
  if ((*version & 0xff) != 2)
    return refuse_partial(fmt::format("file version {}, expected 2", *version & 0xff));
  if (*version & 0x200) return refuse_partial("it is tiled; a partial has scanlines");
  if (*version & 0x800) return refuse_partial("it has deep data");
  if (*version & 0x1000) return refuse_partial("it has several parts; a partial has one");
  if (*version >> 8) return refuse_partial(fmt::format("unexpected version flags {:#x}", *version));
  return {};
}

std::vector<std::string> file_channels(AovSet aovs) {
  std::vector<std::string> names;
  for (const int plane : kFileOrder)
    names.emplace_back(kPartialChannelNames[static_cast<std::size_t>(plane)]);
  for (std::string& name : planes_of(aovs).names) names.push_back(std::move(name));
  return names;
}

// Returns the names of all channels, or an error unless each is of type FLOAT and not subsampled.
Result<std::vector<std::string_view>> channel_names(std::span<const std::byte> raw) {
  ByteReader in(raw);
  std::vector<std::string_view> names;
  while (true) {
    const auto name = in.name(kMaxNameBytes);
    if (!name) return refuse_partial("the channel list is cut off");
    if (name->empty()) break;
    const auto type = in.take<std::int32_t>(), linear = in.take<std::int32_t>(), xs = in.take<std::int32_t>(),
               ys = in.take<std::int32_t>();
    if (!type || !linear || !xs || !ys) return refuse_partial("the channel list is cut off");
    if (*type != 2) return refuse_partial(fmt::format("channel '{}' is not of type FLOAT", *name));
    if (*xs != 1 || *ys != 1)
      return refuse_partial(fmt::format("channel '{}' has sampling {}x{}, expected 1x1", *name, *xs, *ys));
    names.push_back(*name);
  }
  if (in.left() != 0) return refuse_partial("the channel list has more bytes than channels");
  return names;
}

// Returns the AOVs of which at least one channel is among `names`. There are as many light groups as the
// largest two-digit number after the AOV's name says, but at most kMostLightGroups; and likewise the slices
// of a deep image.
AovSet aovs_among(std::span<const std::string_view> names) {
  AovSet set;
  std::size_t groups = 0;
  for (const AovRow& row : aov_rows()) {
    const std::string prefix = fmt::format("{}.{}.", row.kind == AovKind::ids ? "id" : "aov", row.name);
    for (const std::string_view name : names) {
      if (!name.starts_with(prefix)) continue;
      set = set.with(row.aov);
      std::size_t group = 0;
      const std::string_view rest = name.substr(prefix.size());
      if (row.kind == AovKind::groups &&
          std::from_chars(rest.data(), rest.data() + rest.size(), group).ec == std::errc())
        groups = std::max(groups, std::min(group, kMostLightGroups - 1) + 1);
    }
  }
  return set.with_groups(groups).with_deep(deep_slices_among(names));
}

Result<AovSet> check_channels(std::span<const std::byte> raw) {
  const auto names = channel_names(raw);
  if (!names) return tl::unexpected(names.error());
  const AovSet aovs = aovs_among(*names);
  const auto want = file_channels(aovs);
  for (std::size_t i = 0; i < std::max(want.size(), names->size()); ++i) {
    const std::string_view is = i < names->size() ? (*names)[i] : "nothing",
                           should = i < want.size() ? std::string_view(want[i]) : "nothing";
    if (is != should)
      return refuse_partial(fmt::format(
          "channel '{}' stands where '{}' belongs (A.B A.G A.R B.B B.G B.R and those of AOVs, no others)", is,
          should));
  }
  return aovs;
}

Result<PixelRect> read_window(std::string_view name, std::span<const std::byte> raw) {
  std::int32_t v[4];  // bounds of the window in pixels, inclusive: x0, y0, x1, y1
  std::memcpy(v, raw.data(), sizeof v);
  for (const std::int32_t x : v)
    if (x < 0 || x >= kMaxFrameSide)
      return refuse_partial(fmt::format("{} [{},{},{},{}] is out of range", name, v[0], v[1], v[2], v[3]));
  if (v[0] > v[2] || v[1] > v[3]) return refuse_partial(fmt::format("{} is empty", name));
  return PixelRect{v[0], v[1], v[2] + 1, v[3] + 1};
}

Result<void> read_attribute(const Attribute& attribute, std::span<const std::byte> raw, Shape& shape) {
  if (attribute.name == "channels") {
    const auto aovs = check_channels(raw);
    if (!aovs) return tl::unexpected(aovs.error());
    shape.aovs = *aovs;
  }
  if (attribute.name == "compression" && raw[0] != std::byte{0})
    return refuse_partial("it is compressed; partials are not");
  if (attribute.name == "lineOrder" && raw[0] != std::byte{0})
    return refuse_partial("its lines are not in order from the top");
  if (attribute.name == kUnitAttribute)
    shape.unit = std::string_view(reinterpret_cast<const char*>(raw.data()), raw.size());
  if (attribute.type == "box2i") {
    const auto window = read_window(attribute.name, raw);
    if (!window) return tl::unexpected(window.error());
    (attribute.name == "dataWindow" ? shape.data : shape.display) = *window;
  }
  return {};
}

Result<const Attribute*> find_attribute(std::string_view name, std::string_view type, std::int32_t size) {
  for (const Attribute& a : kAttributes) {
    if (a.name != name) continue;
    if (a.type != type)
      return refuse_partial(fmt::format("attribute '{}' has type '{}', expected '{}'", name, type, a.type));
    if (size < 0 || size > (name == "channels" ? kMaxChannelList : kMaxUnitJson) ||
        (a.size && size != a.size))
      return refuse_partial(fmt::format("attribute '{}' has {} bytes", name, size));
    return &a;
  }
  return refuse_partial(fmt::format("attribute '{}' does not belong in a partial", name));
}

Result<Shape> read_shape(std::span<const std::byte> exr) {
  ByteReader in(exr);
  if (const auto ok = check_magic(in); !ok) return tl::unexpected(ok.error());
  Shape shape;
  std::uint32_t seen = 0;
  while (true) {
    const auto name = in.name(kMaxNameBytes);
    if (!name) return refuse_partial("the header is cut off or has an over-long name");
    if (name->empty()) break;
    const auto type = in.name(kMaxNameBytes);
    const auto size = in.take<std::int32_t>();
    if (!type || !size) return refuse_partial(fmt::format("the header is cut off at attribute '{}'", *name));
    const auto attribute = find_attribute(*name, *type, *size);
    if (!attribute) return tl::unexpected(attribute.error());
    const auto bit = std::uint32_t{1} << (*attribute - kAttributes);
    if (seen & bit) return refuse_partial(fmt::format("attribute '{}' occurs twice", *name));
    seen |= bit;
    const auto raw = in.bytes(static_cast<std::size_t>(*size));
    if (!raw) return refuse_partial(fmt::format("the header is cut off in attribute '{}'", *name));
    if (const auto ok = read_attribute(**attribute, *raw, shape); !ok) return tl::unexpected(ok.error());
  }
  for (const Attribute& a : kAttributes)
    if (!(seen & (std::uint32_t{1} << (&a - kAttributes))))
      return refuse_partial(fmt::format("attribute '{}' is missing", a.name));
  if (shape.display->x0 != 0 || shape.display->y0 != 0)
    return refuse_partial("displayWindow does not begin at (0, 0)");
  shape.pixels_at = in.position();
  return shape;
}

std::string pixel_name(const PixelRect& t, std::size_t i) {
  const auto p = static_cast<int>(i);
  return fmt::format("pixel ({}, {})", t.x0 + p % t.width(), t.y0 + p / t.width());
}

Result<std::vector<float>> read_pixels(std::span<const std::byte> exr, const Shape& shape) {
  const PixelRect& t = *shape.data;
  if (t.pixels() > kMaxPartialPixels)
    return refuse_partial(
        fmt::format("tile {} has {} pixels, the limit is {}", show(t), t.pixels(), kMaxPartialPixels));
  const auto width = static_cast<std::size_t>(t.width()), height = static_cast<std::size_t>(t.height());
  const std::size_t further = planes_of(shape.aovs).count(), channels = kPartialChannels + further;
  const std::size_t line = width * channels * sizeof(float);
  const std::size_t want = shape.pixels_at + height * (8 + 8 + line);
  if (exr.size() != want)
    return refuse_partial(fmt::format("{} bytes, but tile {} needs exactly {}", exr.size(), show(t), want));

  std::vector<float> sums(width * height * channels);
  ByteReader table(exr.subspan(shape.pixels_at, height * 8)),
      lines(exr.subspan(shape.pixels_at + height * 8));
  for (std::size_t y = 0; y < height; ++y) {
    const std::uint64_t at = shape.pixels_at + height * 8 + y * (8 + line);
    if (table.take<std::uint64_t>() != at)
      return refuse_partial(fmt::format("line table: entry {} is wrong", y));
    if (lines.take<std::int32_t>() != t.y0 + static_cast<std::int32_t>(y) ||
        lines.take<std::int32_t>() != static_cast<std::int32_t>(line))
      return refuse_partial(fmt::format("line {}: wrong number or size", y));
    for (std::size_t c = 0; c < channels; ++c) {
      const std::size_t plane = c < kFileOrder.size() ? static_cast<std::size_t>(kFileOrder[c]) : c;
      // The size of the file was checked, so the bytes of this row exist and bytes() does not fail.
      const auto row = lines.bytes(width * sizeof(float));
      std::memcpy(sums.data() + (plane * height + y) * width, row->data(), row->size());
    }
  }
  return sums;
}

Result<UnitHeader> read_header(const Shape& shape) {
  auto header = parse_unit_header(*shape.unit);
  if (!header) return refuse_partial(header.error().message);
  if (header->tile != *shape.data)
    return refuse_partial(
        fmt::format("dataWindow {} is not the unit's tile {}", show(*shape.data), show(header->tile)));
  if (header->tile.x1 > shape.display->x1 || header->tile.y1 > shape.display->y1)
    return refuse_partial(fmt::format("tile {} is not inside the frame {}x{}", show(header->tile),
                                      shape.display->x1, shape.display->y1));
  return header;
}

Result<void> check_unit(const UnitHeader& got, const UnitHeader& want) {
  const auto digest = [](std::string_view what, const Digest& g, const Digest& w) {
    return refuse_partial(fmt::format("it is of {} {}, expected {}", what, g.hex(), w.hex()));
  };
  if (got.scene != want.scene) return digest("scene", got.scene, want.scene);
  if (got.settings != want.settings) return digest("settings", got.settings, want.settings);
  if (got.numeric_class != want.numeric_class)
    return digest("numeric class", got.numeric_class, want.numeric_class);
  if (got.tile != want.tile)
    return refuse_partial(fmt::format("it is of tile {}, expected {}", show(got.tile), show(want.tile)));
  if (got.samples != want.samples)
    return refuse_partial(fmt::format("it has samples [{}, {}), expected [{}, {})", got.samples.s0,
                                      got.samples.s1, want.samples.s0, want.samples.s1));
  return {};
}

// Returns an error if a value is not finite. The message names the first such pixel and channel, and contains
// the value.
Result<void> all_finite(const Partial& partial) {
  const PixelRect& t = partial.header.tile;
  const auto pixels = static_cast<std::size_t>(t.pixels());
  for (std::size_t i = 0; i < partial.sums.size(); ++i) {
    if (std::isfinite(partial.sums[i])) continue;
    const std::size_t plane = i / pixels;
    const std::string name = plane < kPartialChannels
                                 ? kPartialChannelNames[plane]
                                 : planes_of(partial.aovs).names[plane - kPartialChannels];
    return refuse_partial(
        fmt::format("channel {} of {} is {}", name, pixel_name(t, i % pixels), partial.sums[i]));
  }
  return {};
}

// Returns an error if numbers of samples or identifiers are impossible. The message names the first such
// pixel and AOV.
Result<void> counts_possible(const Partial& partial) {
  if (partial.aovs.empty()) return {};
  const AovPlanes planes = planes_of(partial.aovs);
  const PixelRect& t = partial.header.tile;
  const auto pixels = static_cast<std::size_t>(t.pixels());
  const std::uint64_t samples = partial.header.samples.count();
  const float* ids = partial.sums.data() + (kPartialChannels + planes.all_sums()) * pixels;
  for (const Aov aov : planes.ids) {
    for (std::size_t i = 0; i < pixels; ++i)
      if (const std::string wrong = wrong_with(load_slots(ids + i, pixels), samples); !wrong.empty())
        return refuse_partial(fmt::format("{} of {}: {}", row_of(aov).name, pixel_name(t, i), wrong));
    ids += kIdPlanes * pixels;
  }
  if (planes.hits == SIZE_MAX) return {};
  const float* hits = partial.sums.data() + (kPartialChannels + planes.hits) * pixels;
  for (std::size_t i = 0; i < pixels; ++i)
    if (!(hits[i] >= 0 && hits[i] <= static_cast<float>(samples) && hits[i] == std::floor(hits[i])))
      return refuse_partial(
          fmt::format("channel aov.hits of {} is {}, of {} samples", pixel_name(t, i), hits[i], samples));
  return {};
}

Result<Partial> finish(std::span<const std::byte> exr, const Shape& shape, UnitHeader header) {
  auto sums = read_pixels(exr, shape);
  if (!sums) return tl::unexpected(sums.error());
  Partial partial{std::move(header), std::move(*sums), shape.aovs};
  if (const auto finite = all_finite(partial); !finite) return tl::unexpected(finite.error());
  if (const auto possible = counts_possible(partial); !possible) return tl::unexpected(possible.error());
  return partial;
}

std::string described(AovSet aovs) {
  const DeepSlices deep = aovs.deep();
  return fmt::format("the AOVs [{}]{}{}", fmt::join(names_of(aovs), ", "),
                     aovs.groups() > 0 ? fmt::format(" with {} light groups", aovs.groups()) : "",
                     deep.count > 0 ? fmt::format(" and {} slices {}colours", deep.count,
                                                  deep.colours ? "with " : "without ")
                                    : "");
}

}  // namespace

Result<Partial> decode_partial(std::span<const std::byte> exr, const UnitHeader& expected, FrameSize frame,
                               AovSet aovs) {
  const auto shape = read_shape(exr);
  if (!shape) return tl::unexpected(shape.error());
  if (shape->aovs != aovs)
    return refuse_partial(fmt::format("it has {}, expected {}", described(shape->aovs), described(aovs)));
  const PixelRect& display = *shape->display;
  if (display.x1 != frame.width || display.y1 != frame.height)
    return refuse_partial(
        fmt::format("its frame is {}x{}, expected {}x{}", display.x1, display.y1, frame.width, frame.height));
  auto header = read_header(*shape);
  if (!header) return tl::unexpected(header.error());
  if (const auto ok = check_unit(*header, expected); !ok) return tl::unexpected(ok.error());
  return finish(exr, *shape, std::move(*header));
}

Result<PartialFile> decode_partial_file(std::span<const std::byte> exr) {
  const auto shape = read_shape(exr);
  if (!shape) return tl::unexpected(shape.error());
  auto header = read_header(*shape);
  if (!header) return tl::unexpected(header.error());
  auto partial = finish(exr, *shape, std::move(*header));
  if (!partial) return tl::unexpected(partial.error());
  return PartialFile{std::move(*partial), {shape->display->x1, shape->display->y1}};
}

namespace {

Result<void> check(const Partial& partial, FrameSize frame) {
  const PixelRect& t = partial.header.tile;
  if (!lies_in(frame, t))
    return bad_argument(
        fmt::format("partial: tile {} does not lie in the frame {}x{}", show(t), frame.width, frame.height));
  if (t.pixels() > kMaxPartialPixels)
    return bad_argument(
        fmt::format("partial: tile of {} pixels, the limit is {}", t.pixels(), kMaxPartialPixels));
  const auto want =
      static_cast<std::uint64_t>(t.pixels()) * (kPartialChannels + planes_of(partial.aovs).count());
  if (partial.sums.size() != want)
    return bad_argument(fmt::format("partial: {} sums, the tile needs {}", partial.sums.size(), want));
  if (const auto finite = all_finite(partial); !finite) return finite;
  return counts_possible(partial);
}

Imath::Box2i inclusive(int x0, int y0, int x1, int y1) { return {{x0, y0}, {x1 - 1, y1 - 1}}; }

}  // namespace

Result<std::vector<std::byte>> encode_partial(const Partial& partial, FrameSize frame) {
  if (const auto ok = check(partial, frame); !ok) return tl::unexpected(ok.error());
  return exr::guarded(Errc::internal, "encoding a partial", [&]() -> Result<std::vector<std::byte>> {
    const PixelRect& t = partial.header.tile;
    Imf::Header header(inclusive(0, 0, frame.width, frame.height), inclusive(t.x0, t.y0, t.x1, t.y1), 1,
                       {0, 0}, 1, Imf::INCREASING_Y, Imf::NO_COMPRESSION);
    header.insert(kUnitAttribute, Imf::StringAttribute(canonical_json(partial.header)));
    Imf::FrameBuffer buffer;
    const float* plane = partial.sums.data();
    const auto add = [&](const char* name) {
      header.channels().insert(name, Imf::Channel(Imf::FLOAT));
      buffer.insert(name, Imf::Slice::Make(Imf::FLOAT, plane, {t.x0, t.y0}, t.width(), t.height()));
      plane += t.pixels();
    };
    for (const char* name : kPartialChannelNames) add(name);
    for (const std::string& name : planes_of(partial.aovs).names) add(name.c_str());
    exr::MemoryWriter out;
    out.reserve(partial.sums.size() * sizeof(float) + static_cast<std::size_t>(t.height()) * 16 + 2048);
    {
      Imf::OutputFile file(out, header, /*numThreads=*/0);
      file.setFrameBuffer(buffer);
      file.writePixels(t.height());
    }
    return out.take();
  });
}

}  // namespace ls
