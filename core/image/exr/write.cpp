#include <ImfChannelList.h>
#include <ImfDeepFrameBuffer.h>
#include <ImfDeepScanLineOutputFile.h>
#include <ImfFrameBuffer.h>
#include <ImfFramesPerSecond.h>
#include <ImfHeader.h>
#include <ImfMultiPartOutputFile.h>
#include <ImfOutputFile.h>
#include <ImfOutputPart.h>
#include <ImfPartType.h>
#include <ImfStandardAttributes.h>
#include <ImfStringAttribute.h>
#include <half.h>

#include <algorithm>
#include <array>
#include <optional>

#include "core/base/overloaded.h"
#include "core/image/exr/exr_file.h"
#include "core/image/exr/memory.h"
#include "core/image/exr/seal.h"

namespace ls {
namespace {

// Compression level of zlib, from 1 (fast) to 9. It is low because users wait for the image, and higher
// levels hardly make noisy pixels smaller.
constexpr int kZipLevel = 2;

std::vector<half> to_half(const std::vector<float>& values) {
  std::vector<half> out(values.size());
  for (std::size_t i = 0; i < values.size(); ++i) out[i] = half(values[i]);
  return out;
}

Imf::PixelType type_of(const std::variant<ExrHalf, ExrFloat, ExrUint>& channel) {
  return std::visit(
      overloaded{[](const ExrHalf&) { return Imf::HALF; }, [](const ExrFloat&) { return Imf::FLOAT; },
                 [](const ExrUint&) { return Imf::UINT; }},
      channel);
}

Result<void> check(const ExrPicture& picture) {
  const FrameSize size = picture.size;
  if (size.width < 1 || size.height < 1) return bad_argument("writing an EXR: the image is empty");
  for (const auto& [name, channel] : picture.channels)
    if (std::visit([](const auto& c) { return c.values.size(); }, channel) != size.pixels())
      return fail(Errc::internal, fmt::format("writing an EXR: channel {} has the wrong size", name));
  return {};
}

// Returns the name of the part of a channel in a file with a part for each layer.
std::string part_of(const std::string& channel) {
  const std::size_t dot = channel.rfind('.');
  if (dot != channel.npos) return channel.substr(0, dot);
  return channel.size() == 1 ? kColourPart : channel;
}

// Writes those channels of some rows that the file has; the first row is the file's row y0. `file` is an
// OutputFile or an OutputPart.
template <class File>
void write_rows(File& file, const Imf::ChannelList& channels, const ExrPicture& rows, int y0) {
  Imf::FrameBuffer buffer;
  // The values of the half layers, to which slices of the frame buffer point. When the outer vector grows, it
  // moves the inner vectors without copying their values, so the pointers stay valid.
  std::vector<std::vector<half>> halves;
  const auto add = [&](const std::string& name, Imf::PixelType type, const void* data) {
    buffer.insert(name, Imf::Slice::Make(type, data, {0, y0}, rows.size.width, rows.size.height));
  };
  for (const auto& entry : rows.channels) {
    const std::string& name = entry.first;
    if (!channels.findChannel(name)) continue;
    std::visit(overloaded{[&](const ExrHalf& c) {
                            add(name, Imf::HALF, halves.emplace_back(to_half(c.values)).data());
                          },
                          [&](const ExrFloat& c) { add(name, Imf::FLOAT, c.values.data()); },
                          [&](const ExrUint& c) { add(name, Imf::UINT, c.values.data()); }},
               entry.second);
  }
  file.setFrameBuffer(buffer);
  file.writePixels(rows.size.height);
}

Imath::M44f matrix_of(const RowMatrix& m) {
  Imath::M44f out;
  for (std::size_t i = 0; i < m.size(); ++i)
    out[static_cast<int>(i / 4)][static_cast<int>(i % 4)] = static_cast<float>(m[i]);
  return out;
}

void add_standard(const StandardAttributes& from, Imf::Header& header) {
  if (from.chromaticities) {
    const auto xy = [](const Chromaticity& c) {
      return Imath::V2f(static_cast<float>(c[0]), static_cast<float>(c[1]));
    };
    const Chromaticities& c = *from.chromaticities;
    Imf::addChromaticities(header, {xy(c.red), xy(c.green), xy(c.blue), xy(c.white)});
  }
  if (from.camera) Imf::addWorldToCamera(header, matrix_of(from.camera->world_to_camera));
  if (from.camera && from.camera->world_to_ndc)
    Imf::addWorldToNDC(header, matrix_of(*from.camera->world_to_ndc));
  // NTSC's rates, such as 23.976, become their exact fractions.
  if (from.frames_per_second) Imf::addFramesPerSecond(header, Imf::guessExactFps(*from.frames_per_second));
}

Imf::Compression compression_of(ExrCompression c) {
  switch (c) {
    case ExrCompression::none:
      return Imf::NO_COMPRESSION;
    case ExrCompression::rle:
      return Imf::RLE_COMPRESSION;
    case ExrCompression::zips:
      return Imf::ZIPS_COMPRESSION;
    case ExrCompression::zip:
      return Imf::ZIP_COMPRESSION;
    case ExrCompression::piz:
      return Imf::PIZ_COMPRESSION;
    case ExrCompression::dwaa:
      return Imf::DWAA_COMPRESSION;
    case ExrCompression::dwab:
      return Imf::DWAB_COMPRESSION;
  }
  return Imf::ZIP_COMPRESSION;
}

Imf::Header header_of(FrameSize size, ExrCompression compression = ExrCompression::zip) {
  Imf::Header header(size.width, size.height, 1, {0, 0}, 1, Imf::INCREASING_Y, compression_of(compression));
  header.zipCompressionLevel() = kZipLevel;
  return header;
}

void add_strings(const std::map<std::string, std::string>& strings, Imf::Header& header) {
  for (const auto& [name, text] : strings) header.insert(name, Imf::StringAttribute(text));
}

// Returns the headers of the file's parts. All header strings are in the first one; those that programs look
// for beside a Cryptomatte are beside it, too.
std::vector<Imf::Header> headers_of(const ExrBands& bands, const ExrPicture& first) {
  std::vector<Imf::Header> headers;
  std::vector<std::string> names;
  const auto part = [&](const std::string& name) -> Imf::Header& {
    if (const auto found = std::ranges::find(names, name); found != names.end())
      return headers[static_cast<std::size_t>(found - names.begin())];
    const bool lossless = is_lossy(bands.compression) && !bands.lossy_parts.contains(name);
    Imf::Header& header =
        headers.emplace_back(header_of(bands.size, lossless ? ExrCompression::zip : bands.compression));
    names.push_back(name);
    add_standard(bands.standard, header);
    if (bands.parts == ExrParts::one) return header;
    header.setName(name);
    header.setType(Imf::SCANLINEIMAGE);
    if (name.starts_with("crypto_")) add_strings(first.strings, header);
    return header;
  };
  part(kColourPart);
  for (const auto& [name, channel] : first.channels)
    part(bands.parts == ExrParts::one ? kColourPart : part_of(name))
        .channels()
        .insert(name, Imf::Channel(type_of(channel)));
  add_strings(first.strings, headers[0]);
  add_strings(bands.strings, headers[0]);
  return headers;
}

// Calls take(rows, y) for each band, where y is the band's first row in the file.
template <class Take>
Result<void> each_band(const ExrBands& bands, Take take) {
  for (int band = 0, y = 0; y < bands.size.height; ++band) {
    const ExrPicture rows = bands.band(band);
    if (auto sound = check(rows); !sound) return sound;
    if (rows.size.width != bands.size.width || rows.size.height > bands.size.height - y)
      return fail(Errc::internal, "writing an EXR: its bands are not those of one picture");
    take(rows, y);
    y += rows.size.height;
  }
  return {};
}

// Writes the bands as an EXR file with a seal. The seal covers the pixels, but it is in the header, which
// comes before the pixels in the file. So the bands are generated twice: first to compute the seal, then to
// write the file.
Result<void> write_bands(Imf::OStream& out, const ExrBands& bands) {
  if (bands.size.width < 1 || bands.size.height < 1)
    return bad_argument("writing an EXR: the image is empty");
  if (is_lossy(bands.compression) && bands.parts == ExrParts::one)
    return bad_argument("writing an EXR: a lossy compression needs a part for each layer");
  std::vector<Imf::Header> headers;
  exr::Seal seal;
  const auto read = each_band(bands, [&](const ExrPicture& rows, int) {
    if (headers.empty()) headers = headers_of(bands, rows);
    seal.add(rows);
  });
  if (!read) return read;
  if (!is_lossy(bands.compression)) {
    for (const Imf::Header& header : headers) seal.add(header);
    headers[0].insert(exr::kSealName, Imf::StringAttribute(seal.text()));
  }
  if (bands.parts == ExrParts::one) {
    Imf::OutputFile file(out, headers[0], /*numThreads=*/0);
    return each_band(
        bands, [&](const ExrPicture& rows, int y) { write_rows(file, headers[0].channels(), rows, y); });
  }
  Imf::MultiPartOutputFile file(out, headers.data(), static_cast<int>(headers.size()),
                                /*overrideSharedAttributes=*/false, /*numThreads=*/0);
  return each_band(bands, [&](const ExrPicture& rows, int y) {
    for (std::size_t p = 0; p < headers.size(); ++p) {
      Imf::OutputPart part(file, static_cast<int>(p));
      write_rows(part, headers[p].channels(), rows, y);
    }
  });
}

// Writes the rows that begin at the file's row y0.
void write_deep_rows(Imf::DeepScanLineOutputFile& file, const ExrPicture& values, int y0) {
  const auto width = static_cast<std::size_t>(values.size.width), skipped = static_cast<std::size_t>(y0);
  std::vector<std::uint32_t> counts = std::get<ExrUint>(values.channels.at("samples")).values;
  // The library finds the pixel (x, y) at base + x * xStride + y * yStride.
  const auto base = [&](auto& of_pixels) {
    return reinterpret_cast<char*>(of_pixels.data()) - skipped * width * sizeof(of_pixels[0]);
  };
  Imf::DeepFrameBuffer buffer;
  buffer.insertSampleCountSlice(
      Imf::Slice(Imf::UINT, base(counts), sizeof counts[0], sizeof counts[0] * width));
  std::vector<std::vector<half>> halves;
  std::vector<std::vector<const void*>> pointers;
  const auto add = [&](const std::string& name, Imf::PixelType type, const auto* data) {
    auto& of_channel = pointers.emplace_back(counts.size());
    for (std::size_t i = 0; i < counts.size(); data += counts[i++]) of_channel[i] = data;
    buffer.insert(name,
                  Imf::DeepSlice(type, base(of_channel), sizeof(void*), sizeof(void*) * width, sizeof *data));
  };
  halves.reserve(values.channels.size());
  pointers.reserve(values.channels.size());
  for (const auto& entry : values.channels) {
    const std::string& name = entry.first;
    std::visit(
        overloaded{
            [&](const ExrHalf& c) { add(name, Imf::HALF, halves.emplace_back(to_half(c.values)).data()); },
            [&](const ExrFloat& c) { add(name, Imf::FLOAT, c.values.data()); }, [](const ExrUint&) {}},
        entry.second);
  }
  file.setFrameBuffer(buffer);
  file.writePixels(values.size.height);
}

// Generates the bands twice, as write_bands() does: for the seal, and for the file.
Result<void> write_deep_bands(Imf::OStream& out, const DeepBands& bands) {
  if (bands.size.width < 1 || bands.size.height < 1)
    return bad_argument("writing a deep EXR: the image is empty");
  const auto each = [&](const auto& take) -> Result<void> {
    for (int band = 0, y = 0; y < bands.size.height; ++band) {
      const DeepRows rows = bands.band(band);
      if (rows.size.width != bands.size.width || rows.size.height > bands.size.height - y ||
          rows.counts.size() != rows.size.pixels())
        return fail(Errc::internal, "writing a deep EXR: its bands are not those of one picture");
      take(exr::values_of(rows, bands.colours, !bands.floats), y);
      y += rows.size.height;
    }
    return {};
  };
  Imf::Header header = header_of(bands.size, ExrCompression::zips);
  header.setType(Imf::DEEPSCANLINE);
  add_standard(bands.standard, header);
  for (const auto& [name, channel] : exr::values_of({}, bands.colours, !bands.floats).channels)
    if (name != "samples") header.channels().insert(name, Imf::Channel(type_of(channel)));
  add_strings(bands.strings, header);
  exr::Seal seal;
  if (auto read = each([&](const ExrPicture& values, int) { seal.add(values); }); !read) return read;
  seal.add(header);
  header.insert(exr::kSealName, Imf::StringAttribute(seal.text()));
  Imf::DeepScanLineOutputFile file(out, header, /*numThreads=*/0);
  return each([&](const ExrPicture& values, int y) { write_deep_rows(file, values, y); });
}

// A stream that writes to a sink. It can report an error to the library only by an exception, so it keeps the
// sink's own Error in `trouble`.
class SinkStream final : public Imf::OStream {
 public:
  explicit SinkStream(ByteSink& sink) : OStream("image"), sink_(sink) {}
  void write(const char c[], int n) override {
    const auto bytes = std::as_bytes(std::span(c, static_cast<std::size_t>(n)));
    if (auto written = sink_.write(position_, bytes); !written) {
      trouble = written.error();
      throw Iex::IoExc(written.error().message);
    }
    position_ += bytes.size();
  }
  std::uint64_t tellp() override { return position_; }
  void seekp(std::uint64_t position) override { position_ = position; }
  std::optional<Error> trouble;

 private:
  ByteSink& sink_;
  std::uint64_t position_ = 0;
};

constexpr std::array kCompressions{ExrCompression::zip, ExrCompression::zips, ExrCompression::piz,
                                   ExrCompression::rle, ExrCompression::none, ExrCompression::dwaa,
                                   ExrCompression::dwab};
constexpr std::array kParts{ExrParts::one, ExrParts::layers};

}  // namespace

std::span<const ExrCompression> exr_compressions() { return kCompressions; }

std::string_view to_string(ExrCompression c) {
  static constexpr std::string_view kNames[] = {"zip", "zips", "piz", "rle", "none", "dwaa", "dwab"};
  return kNames[static_cast<std::size_t>(c)];
}

std::span<const ExrParts> exr_parts() { return kParts; }

std::string_view to_string(ExrParts parts) { return parts == ExrParts::one ? "one" : "layers"; }

Result<std::vector<std::byte>> write_exr(const ExrPicture& picture) {
  if (auto sound = check(picture); !sound) return tl::unexpected(sound.error());
  return exr::guarded(Errc::internal, "writing an EXR", [&]() -> Result<std::vector<std::byte>> {
    exr::MemoryWriter out;
    {
      Imf::Header header = header_of(picture.size);
      add_strings(picture.strings, header);
      for (const auto& [name, channel] : picture.channels)
        header.channels().insert(name, Imf::Channel(type_of(channel)));
      Imf::OutputFile file(out, header, /*numThreads=*/0);
      write_rows(file, header.channels(), picture, 0);
    }
    return out.take();
  });
}

Result<void> write_sealed_exr(const ExrBands& bands, ByteSink& sink) {
  SinkStream out(sink);
  auto written = exr::guarded(Errc::internal, "writing an EXR", [&] { return write_bands(out, bands); });
  if (out.trouble) return tl::unexpected(*out.trouble);
  return written;
}

Result<void> write_sealed_deep_exr(const DeepBands& bands, ByteSink& sink) {
  SinkStream out(sink);
  auto written =
      exr::guarded(Errc::internal, "writing a deep EXR", [&] { return write_deep_bands(out, bands); });
  if (out.trouble) return tl::unexpected(*out.trouble);
  return written;
}

}  // namespace ls
