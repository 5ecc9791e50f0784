// Reads EXR files: external images, and final EXRs of this program.
#include <ImfChannelList.h>
#include <ImfChromaticities.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfInputPart.h>
#include <ImfMultiPartInputFile.h>
#include <ImfPartType.h>
#include <ImfStandardAttributes.h>
#include <ImfStringAttribute.h>
#include <half.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <initializer_list>
#include <optional>
#include <string_view>

#include "core/image/exr/exr_file.h"
#include "core/image/exr/final_image.h"
#include "core/image/exr/memory.h"
#include "core/image/exr/seal.h"
#include "core/image/frame/render_limits.h"

namespace ls {

namespace {

// Which channels of a part are read: their names, and for each channel of the image the index of its name.
struct Source {
  int part = 0;
  std::vector<const char*> channels;
  std::vector<std::size_t> layout{0, 1, 2};
};

bool has_all(const Imf::ChannelList& list, std::initializer_list<const char*> names) {
  return std::ranges::all_of(names, [&](const char* c) { return list.findChannel(c) != nullptr; });
}

// Wanted: what a caller makes of the image. `rgb`: only its numbers in R, G, B. `texture`: its colours in any
// form that can be converted, and its alpha channel.
enum class Wanted { rgb, texture };

Result<Source> find_colour(const Imf::MultiPartInputFile& file, const std::string& name, Wanted wanted) {
  for (int p = 0; p < file.parts(); ++p) {
    const Imf::Header& header = file.header(p);
    if (header.hasType() && !Imf::isImage(header.type())) continue;  // skips deep parts
    const Imf::ChannelList& list = header.channels();
    const bool rgb = has_all(list, {"R", "G", "B"});
    const bool xyz = !rgb && wanted == Wanted::texture && has_all(list, {"X", "Y", "Z"});
    const bool chroma = list.findChannel("RY") || list.findChannel("BY");
    if (!rgb && !xyz && (!list.findChannel("Y") || chroma)) continue;
    Source source;
    source.part = p;
    if (rgb)
      source.channels = {"R", "G", "B"};
    else if (xyz)
      source.channels = {"X", "Y", "Z"};
    else
      source.channels = {"Y"}, source.layout = {0, 0, 0};
    const Imf::Channel* alpha = list.findChannel("A");
    const bool readable = alpha && alpha->type != Imf::UINT && alpha->xSampling == 1 && alpha->ySampling == 1;
    if (wanted == Wanted::texture && readable) {
      source.layout.push_back(source.channels.size());
      source.channels.push_back("A");
    }
    for (const char* c : source.channels) {
      const Imf::Channel& channel = list[c];
      if (channel.xSampling != 1 || channel.ySampling != 1)
        return bad_argument(
            fmt::format("{}: channel {} is subsampled; store it at full resolution", name, c));
      if (channel.type == Imf::UINT)
        return bad_argument(fmt::format("{}: channel {} holds integers; half or float is needed", name, c));
    }
    return source;
  }
  return bad_argument(fmt::format(
      "{}: no flat part with channels R, G, B or Y (deep and luminance/chroma images are not read)", name));
}

Chromaticities chromaticities_of(const Imf::Chromaticities& c) {
  const auto xy = [](const Imath::V2f& p) { return Chromaticity{p.x, p.y}; };
  return {xy(c.red), xy(c.green), xy(c.blue), xy(c.white)};
}

bool is_rec709(const Imf::Chromaticities& c) {
  // As in Mitsuba 3.9: primaries closer than this to those of Rec. 709 are the same, written with fewer
  // digits.
  constexpr float kSame = 1e-6f;
  const Imf::Chromaticities rec709;
  return (c.red - rec709.red).length2() + (c.green - rec709.green).length2() +
             (c.blue - rec709.blue).length2() + (c.white - rec709.white).length2() <
         kSame;
}

std::optional<std::array<float, 9>> srgb_matrix(const Imf::Header& header, const Source& source) {
  ColourMatrix m = inverse(to_xyz(chromaticities_of(Imf::Chromaticities())));
  if (source.channels[0] != std::string_view("X")) {
    if (source.channels[0] != std::string_view("R") || !Imf::hasChromaticities(header) ||
        is_rec709(Imf::chromaticities(header)))
      return std::nullopt;
    m = m * to_xyz(chromaticities_of(Imf::chromaticities(header)));
  }
  std::array<float, 9> out{};
  for (std::size_t i = 0; i < 9; ++i) out[i] = static_cast<float>(m(i / 3, i % 3));
  return out;
}

FrameSize size_of(const Imath::Box2i& window) {
  return {window.max.x - window.min.x + 1, window.max.y - window.min.y + 1};
}

// The rows are read and appended in bands, so that a small file that claims a large size costs little memory.
// Returns the channels of each pixel, in the order of source.layout.
std::vector<float> read_part(Imf::MultiPartInputFile& file, const Source& source) {
  const Imath::Box2i window = file.header(source.part).dataWindow();
  const FrameSize size = size_of(window);
  Imf::InputPart part(file, source.part);
  constexpr int kBand = 64;
  const auto width = static_cast<std::size_t>(size.width);
  std::vector<std::vector<float>> planes(source.channels.size(), std::vector<float>(width * kBand));
  std::vector<float> values;
  for (int y0 = 0; y0 < size.height; y0 += kBand) {
    const int rows = std::min(kBand, size.height - y0);
    Imf::FrameBuffer buffer;
    for (std::size_t c = 0; c < planes.size(); ++c)
      buffer.insert(source.channels[c],
                    Imf::Slice::Make(Imf::FLOAT, planes[c].data(), {window.min.x, window.min.y + y0},
                                     size.width, rows, sizeof(float), sizeof(float) * width));
    part.setFrameBuffer(buffer);
    part.readPixels(window.min.y + y0, window.min.y + y0 + rows - 1);
    const std::size_t first = values.size(), count = width * static_cast<std::size_t>(rows),
                      channels = source.layout.size();
    values.resize(first + channels * count);
    for (std::size_t i = 0; i < count; ++i)
      for (std::size_t c = 0; c < channels; ++c)
        values[first + channels * i + c] = planes[source.layout[c]][i];
  }
  return values;
}

constexpr const char* kErrors[3] = {"stderr.R", "stderr.G", "stderr.B"};

// Returns the channel `name` if it is not subsampled and has one of the types `types`, otherwise null.
const Imf::Channel* channel_of(const Imf::ChannelList& list, const char* name,
                               std::initializer_list<Imf::PixelType> types) {
  const Imf::Channel* c = list.findChannel(name);
  const bool found =
      c && c->xSampling == 1 && c->ySampling == 1 && std::ranges::find(types, c->type) != types.end();
  return found ? c : nullptr;
}

// Returns the three layers of standard errors, which are in one part of the size of the colours; nullopt: one
// or more are missing.
std::optional<Source> find_error(const Imf::MultiPartInputFile& file, const Source& colour) {
  for (int p = 0; p < file.parts(); ++p) {
    const Imf::Header& header = file.header(p);
    if ((header.hasType() && !Imf::isImage(header.type())) ||
        header.dataWindow() != file.header(colour.part).dataWindow())
      continue;
    if (std::ranges::all_of(kErrors, [&](const char* c) {
          return channel_of(header.channels(), c, {Imf::HALF, Imf::FLOAT}) != nullptr;
        }))
      return Source{p, {std::begin(kErrors), std::end(kErrors)}, {0, 1, 2}};
  }
  return std::nullopt;
}

std::map<std::string, std::string> strings_of(const Imf::Header& header) {
  std::map<std::string, std::string> out;
  for (auto at = header.begin(); at != header.end(); ++at)
    if (const auto* text = dynamic_cast<const Imf::StringAttribute*>(&at.attribute()))
      out.emplace(at.name(), text->value());
  return out;
}

// Opens a file, after its headers were checked, and calls f(file), which returns a Result<T>.
template <class T, class F>
Result<T> opened(std::span<const std::byte> bytes, const std::string& name, const ExrLimits& limits, F f) {
  if (bytes.size() > limits.max_bytes)
    return fail(Errc::resource_exhausted, fmt::format("{}: the file has {} bytes, more than the limit of {}",
                                                      name, bytes.size(), limits.max_bytes));
  return exr::guarded(
      Errc::invalid_argument, fmt::format("{}: cannot read this EXR", name), [&]() -> Result<T> {
        if (const auto ok = exr::check_headers(bytes, name, limits); !ok) return tl::unexpected(ok.error());
        exr::MemoryReader in(bytes, name);
        Imf::MultiPartInputFile file(in, /*numThreads=*/0, /*reconstructChunkOffsetTable=*/false);
        return f(file);
      });
}

Result<RgbWithError> read_colour(std::span<const std::byte> bytes, const std::string& name,
                                 const ExrLimits& limits, bool with_error) {
  return opened<RgbWithError>(
      bytes, name, limits, [&](Imf::MultiPartInputFile& file) -> Result<RgbWithError> {
        const auto source = find_colour(file, name, Wanted::rgb);
        if (!source) return tl::unexpected(source.error());
        const Imf::Header& header = file.header(source->part);
        if (Imf::hasChromaticities(header) && !is_rec709(Imf::chromaticities(header)))
          return bad_argument(fmt::format(
              "{}: its colours are not those of Rec. 709, by the `chromaticities` in its header: convert it, "
              "or write it with the color_space rec709",
              name));
        RgbWithError out{{size_of(header.dataWindow()), read_part(file, *source)}, {}, strings_of(header)};
        if (const auto layers = with_error ? find_error(file, *source) : std::nullopt)
          out.error = read_part(file, *layers);
        return out;
      });
}

}  // namespace

Result<RgbImage> read_exr_rgb(std::span<const std::byte> bytes, const std::string& name,
                              const ExrLimits& limits) {
  auto read = read_colour(bytes, name, limits, false);
  if (!read) return tl::unexpected(read.error());
  return std::move(read->image);
}

Result<ExrImage> read_exr_image(std::span<const std::byte> bytes, const std::string& name,
                                const ExrLimits& limits) {
  return opened<ExrImage>(bytes, name, limits, [&](Imf::MultiPartInputFile& file) -> Result<ExrImage> {
    const auto source = find_colour(file, name, Wanted::texture);
    if (!source) return tl::unexpected(source.error());
    const Imf::Header& header = file.header(source->part);
    return ExrImage{size_of(header.dataWindow()), static_cast<std::uint32_t>(source->layout.size()),
                    read_part(file, *source), srgb_matrix(header, *source)};
  });
}

Result<RgbWithError> read_exr_with_error(std::span<const std::byte> bytes, const std::string& name,
                                         const ExrLimits& limits) {
  return read_colour(bytes, name, limits, true);
}

Result<std::vector<std::byte>> read_exr_bytes(const std::filesystem::path& path, const ExrLimits& limits) {
  std::ifstream in(path, std::ios::binary | std::ios::ate);
  if (!in) return fail(Errc::not_found, fmt::format("{}: cannot be opened", path.string()));
  const auto size = static_cast<std::uint64_t>(std::max<std::streamoff>(0, in.tellg()));
  if (size > limits.max_bytes)
    return fail(Errc::resource_exhausted,
                fmt::format("{}: {} bytes, the limit is {}", path.string(), size, limits.max_bytes));
  std::vector<std::byte> bytes(size);
  in.seekg(0);
  if (!in.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(size)))
    return fail(Errc::unavailable, fmt::format("{}: cannot be read", path.string()));
  return bytes;
}

Result<RgbImage> read_exr_rgb(const std::filesystem::path& path, const ExrLimits& limits) {
  const auto bytes = read_exr_bytes(path, limits);
  if (!bytes) return tl::unexpected(bytes.error());
  return read_exr_rgb(*bytes, path.string(), limits);
}

namespace {

constexpr const char* kColours[3] = {"R", "G", "B"};
// largest number of layers of a final EXR; all AOVs together have 74, denoising adds 3
constexpr std::size_t kMaxLayers = 128;

tl::unexpected<Error> bad(const std::string& name, const std::string& what) {
  return bad_argument(fmt::format("{}: {}", name, what));
}

Result<void> check_layers(const Imf::ChannelList& list, const std::string& name, FinalPicture& image) {
  for (const char* colour : kColours) {
    const Imf::Channel* channel = channel_of(list, colour, {Imf::HALF, Imf::FLOAT});
    if (!channel) return bad(name, fmt::format("it has no layer {} of half or float", colour));
    image.half = channel->type == Imf::HALF;
  }
  if (!channel_of(list, "spp", {Imf::UINT})) return bad(name, "it has no layer spp of integers");
  for (const char* error : kErrors)
    if (!channel_of(list, error, {Imf::FLOAT}))
      return bad(name, fmt::format("it has no layer {} of floats", error));
  std::size_t layers = 0;
  for (auto at = list.begin(); at != list.end(); ++at) {
    if (at.channel().xSampling != 1 || at.channel().ySampling != 1)
      return bad(name, fmt::format("its layer {} is subsampled", at.name()));
    if (++layers > kMaxLayers) return bad(name, "it has more layers than any image of ours");
  }
  return {};
}

std::variant<ExrHalf, ExrFloat, ExrUint> empty_channel(Imf::PixelType type, std::size_t pixels) {
  if (type == Imf::UINT) return ExrUint{std::vector<std::uint32_t>(pixels)};
  if (type == Imf::HALF) return ExrHalf{std::vector<float>(pixels)};
  return ExrFloat{std::vector<float>(pixels)};
}

// Reads the rows y0 to y0 + rows - 1 of every layer.
ExrPicture read_rows(Imf::MultiPartInputFile& file, int width, int y0, int rows) {
  ExrPicture band{{width, rows}, {}, {}};
  for (int p = 0; p < file.parts(); ++p) {
    Imf::FrameBuffer buffer;
    const Imf::ChannelList& list = file.header(p).channels();
    for (auto at = list.begin(); at != list.end(); ++at) {
      auto& channel = band.channels[at.name()] =
          empty_channel(at.channel().type, static_cast<std::size_t>(width) * static_cast<std::size_t>(rows));
      const Imf::PixelType type = at.channel().type == Imf::UINT ? Imf::UINT : Imf::FLOAT;
      std::visit(
          [&](auto& c) {
            buffer.insert(at.name(), Imf::Slice::Make(type, c.values.data(), {0, y0}, width, rows));
          },
          channel);
    }
    Imf::InputPart part(file, p);
    part.setFrameBuffer(buffer);
    part.readPixels(y0, y0 + rows - 1);
  }
  return band;
}

void append(const ExrPicture& band, FinalPicture& image) {
  for (const auto& [name, channel] : band.channels)
    std::visit(
        [&]<class Channel>(const Channel& from) {
          auto& to = std::get<Channel>(image.channels.try_emplace(name, Channel{}).first->second).values;
          to.insert(to.end(), from.values.begin(), from.values.end());
        },
        channel);
}

// Reads one band of rows after the other, so that a small file that claims a large size costs little memory.
void read_pixels(Imf::MultiPartInputFile& file, FinalPicture& image) {
  constexpr int kBand = 64;
  exr::Seal seal;
  for (int y0 = 0; y0 < image.size.height; y0 += kBand) {
    const ExrPicture band = read_rows(file, image.size.width, y0, std::min(kBand, image.size.height - y0));
    seal.add(band);
    append(band, image);
  }
  for (int p = 0; p < file.parts(); ++p) seal.add(file.header(p));
  if (const auto sealed = image.strings.find(exr::kSealName); sealed != image.strings.end())
    image.changed = exr::differences(sealed->second, seal.text());
}

// Returns the layers of all parts, which must have one size.
Result<Imf::ChannelList> layers_of(const Imf::MultiPartInputFile& file, const std::string& name) {
  Imf::ChannelList all;
  for (int p = 0; p < file.parts(); ++p) {
    const Imf::Header& header = file.header(p);
    const Imath::Box2i data = header.dataWindow();
    if ((header.hasType() && header.type() != Imf::SCANLINEIMAGE) || data != header.displayWindow() ||
        data.min != Imath::V2i(0, 0) || data != file.header(0).dataWindow())
      return bad(name, "it is no scanline image whose windows begin at 0, 0");
    for (auto at = header.channels().begin(); at != header.channels().end(); ++at) {
      if (all.findChannel(at.name())) return bad(name, fmt::format("it has two layers {}", at.name()));
      all.insert(at.name(), at.channel());
    }
  }
  return all;
}

bool is_lossy(const Imf::Header& header) {
  constexpr Imf::Compression kLossless[] = {Imf::NO_COMPRESSION, Imf::RLE_COMPRESSION, Imf::ZIPS_COMPRESSION,
                                            Imf::ZIP_COMPRESSION, Imf::PIZ_COMPRESSION};
  return std::ranges::find(kLossless, header.compression()) == std::end(kLossless);
}

}  // namespace

float as_half(float value) { return half(value); }

Result<FinalPicture> read_final_exr(std::span<const std::byte> exr, const std::string& name) {
  const ExrLimits limits{.max_bytes = kMaxFinalBytes,
                         .max_pixels = static_cast<std::uint64_t>(kMaxFramePixels),
                         .max_side = kMaxFrameSide};
  if (exr.size() > limits.max_bytes) return bad(name, "the file is larger than any image of ours");
  return opened<FinalPicture>(exr, name, limits, [&](Imf::MultiPartInputFile& file) -> Result<FinalPicture> {
    const auto layers = layers_of(file, name);
    if (!layers) return tl::unexpected(layers.error());
    FinalPicture image;
    image.size = size_of(file.header(0).dataWindow());
    if (const auto ok = check_layers(*layers, name, image); !ok) return tl::unexpected(ok.error());
    for (int p = 0; p < file.parts(); ++p) image.lossy |= is_lossy(file.header(p));
    image.strings = strings_of(file.header(0));
    read_pixels(file, image);
    return image;
  });
}

}  // namespace ls
