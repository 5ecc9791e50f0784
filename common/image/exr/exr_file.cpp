#include "common/image/exr/exr_file.h"

#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfInputPart.h>
#include <ImfMultiPartInputFile.h>
#include <ImfPartType.h>
#include <ImfStringAttribute.h>

#include <fstream>
#include <optional>

#include "common/image/exr/headers.h"
#include "common/image/exr/memory.h"

namespace ls {
namespace {

struct Source {
  int part = 0;
  std::vector<const char*> channels;  // one channel or three
};

Result<Source> find_colour(const Imf::MultiPartInputFile& file, const std::string& name) {
  for (int p = 0; p < file.parts(); ++p) {
    const Imf::Header& header = file.header(p);
    if (header.hasType() && !Imf::isImage(header.type())) continue;  // skips deep parts
    const Imf::ChannelList& list = header.channels();
    const bool rgb = list.findChannel("R") && list.findChannel("G") && list.findChannel("B");
    const bool chroma = list.findChannel("RY") || list.findChannel("BY");
    if (!rgb && (!list.findChannel("Y") || chroma)) continue;
    Source source{p, rgb ? std::vector<const char*>{"R", "G", "B"} : std::vector<const char*>{"Y"}};
    for (const char* c : source.channels) {
      const Imf::Channel& channel = list[c];
      if (channel.xSampling != 1 || channel.ySampling != 1)
        return fail(Errc::invalid_argument,
                    fmt::format("{}: channel {} is subsampled; store it at full resolution", name, c));
      if (channel.type == Imf::UINT)
        return fail(Errc::invalid_argument,
                    fmt::format("{}: channel {} holds integers; half or float is needed", name, c));
    }
    return source;
  }
  return fail(
      Errc::invalid_argument,
      fmt::format(
          "{}: no flat part with channels R, G, B or Y (deep and luminance/chroma images are not read)",
          name));
}

FrameSize size_of(const Imath::Box2i& window) {
  return {window.max.x - window.min.x + 1, window.max.y - window.min.y + 1};
}

// The rows are read and appended in bands, so that a small file that claims a large size costs little memory.
Result<RgbImage> read_part(Imf::MultiPartInputFile& file, const Source& source) {
  const Imath::Box2i window = file.header(source.part).dataWindow();
  const FrameSize size = size_of(window);
  Imf::InputPart part(file, source.part);
  constexpr int kBand = 64;
  const auto width = static_cast<std::size_t>(size.width);
  std::vector<std::vector<float>> planes(source.channels.size(), std::vector<float>(width * kBand));
  RgbImage image{size, {}};
  for (int y0 = 0; y0 < size.height; y0 += kBand) {
    const int rows = std::min(kBand, size.height - y0);
    Imf::FrameBuffer buffer;
    for (std::size_t c = 0; c < planes.size(); ++c)
      buffer.insert(source.channels[c],
                    Imf::Slice::Make(Imf::FLOAT, planes[c].data(), {window.min.x, window.min.y + y0},
                                     size.width, rows, sizeof(float), sizeof(float) * width));
    part.setFrameBuffer(buffer);
    part.readPixels(window.min.y + y0, window.min.y + y0 + rows - 1);
    const std::size_t first = image.rgb.size(), count = width * static_cast<std::size_t>(rows);
    image.rgb.resize(first + 3 * count);
    for (std::size_t i = 0; i < count; ++i)
      for (std::size_t c = 0; c < 3; ++c)
        image.rgb[first + 3 * i + c] = planes[planes.size() == 3 ? c : 0][i];
  }
  return image;
}

// Returns the part's layers of standard errors; nullopt unless it has all of them.
std::optional<Source> find_error(const Imf::MultiPartInputFile& file, const Source& colour) {
  const Imf::ChannelList& list = file.header(colour.part).channels();
  const Source source{colour.part, {"stderr.R", "stderr.G", "stderr.B"}};
  for (const char* c : source.channels) {
    const Imf::Channel* channel = list.findChannel(c);
    if (!channel || channel->xSampling != 1 || channel->ySampling != 1 || channel->type == Imf::UINT)
      return std::nullopt;
  }
  return source;
}

std::map<std::string, std::string> strings_of(const Imf::Header& header) {
  std::map<std::string, std::string> out;
  for (auto at = header.begin(); at != header.end(); ++at)
    if (const auto* text = dynamic_cast<const Imf::StringAttribute*>(&at.attribute()))
      out.emplace(at.name(), text->value());
  return out;
}

Result<RgbWithError> read_colour(std::span<const std::byte> bytes, const std::string& name,
                                 const ExrLimits& limits, bool with_error) {
  if (bytes.size() > limits.max_bytes)
    return fail(Errc::resource_exhausted, fmt::format("{}: the file has {} bytes, more than the limit of {}",
                                                      name, bytes.size(), limits.max_bytes));
  return exr::guarded(
      Errc::invalid_argument, fmt::format("{}: cannot read this EXR", name), [&]() -> Result<RgbWithError> {
        if (const auto ok = exr::check_headers(bytes, name, limits); !ok) return tl::unexpected(ok.error());
        exr::MemoryReader in(bytes, name);
        Imf::MultiPartInputFile file(in, /*numThreads=*/0, /*reconstructChunkOffsetTable=*/false);
        const auto source = find_colour(file, name);
        if (!source) return tl::unexpected(source.error());
        auto image = read_part(file, *source);
        if (!image) return tl::unexpected(image.error());
        RgbWithError out{std::move(*image), {}, strings_of(file.header(source->part))};
        const auto layers = with_error ? find_error(file, *source) : std::nullopt;
        if (!layers) return out;
        auto error = read_part(file, *layers);
        if (!error) return tl::unexpected(error.error());
        out.error = std::move(error->rgb);
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

}  // namespace ls
