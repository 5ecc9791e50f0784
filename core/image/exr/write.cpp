#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfOutputFile.h>
#include <ImfStringAttribute.h>
#include <half.h>

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

// Writes rows to the file; the first of them is the file's row y0.
void write_rows(Imf::OutputFile& file, const ExrPicture& rows, int y0) {
  Imf::FrameBuffer buffer;
  // The values of the half layers, to which slices of the frame buffer point. When the outer vector grows, it
  // moves the inner vectors without copying their values, so the pointers stay valid.
  std::vector<std::vector<half>> halves;
  const auto add = [&](const std::string& name, Imf::PixelType type, const void* data) {
    buffer.insert(name, Imf::Slice::Make(type, data, {0, y0}, rows.size.width, rows.size.height));
  };
  for (const auto& entry : rows.channels) {
    const std::string& name = entry.first;
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

Imf::Header header_of(FrameSize size, const ExrPicture& like,
                      const std::map<std::string, std::string>& strings) {
  Imf::Header header(size.width, size.height, 1, {0, 0}, 1, Imf::INCREASING_Y, Imf::ZIP_COMPRESSION);
  header.zipCompressionLevel() = kZipLevel;
  for (const auto& [name, text] : strings) header.insert(name, Imf::StringAttribute(text));
  for (const auto& [name, channel] : like.channels)
    header.channels().insert(name, Imf::Channel(type_of(channel)));
  return header;
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
  std::optional<Imf::Header> header;
  exr::Seal seal;
  const auto read = each_band(bands, [&](const ExrPicture& rows, int) {
    auto strings = rows.strings;
    strings.insert(bands.strings.begin(), bands.strings.end());
    if (!header) header = header_of(bands.size, rows, strings);
    seal.add(rows);
  });
  if (!read) return read;
  seal.add(*header);
  header->insert(exr::kSealName, Imf::StringAttribute(seal.text()));
  Imf::OutputFile file(out, *header, /*numThreads=*/0);
  return each_band(bands, [&](const ExrPicture& rows, int y) { write_rows(file, rows, y); });
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

}  // namespace

Result<std::vector<std::byte>> write_exr(const ExrPicture& picture) {
  if (auto sound = check(picture); !sound) return tl::unexpected(sound.error());
  return exr::guarded(Errc::internal, "writing an EXR", [&]() -> Result<std::vector<std::byte>> {
    exr::MemoryWriter out;
    {
      Imf::OutputFile file(out, header_of(picture.size, picture, picture.strings), /*numThreads=*/0);
      write_rows(file, picture, 0);
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

}  // namespace ls
