// Reads deep images of this program.
#include <ImfChannelList.h>
#include <ImfDeepFrameBuffer.h>
#include <ImfDeepScanLineInputFile.h>
#include <ImfHeader.h>
#include <ImfPartType.h>
#include <ImfStringAttribute.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <string_view>

#include "core/base/safe_text.h"
#include "core/image/exr/exr_file.h"
#include "core/image/exr/final_image.h"
#include "core/image/exr/memory.h"
#include "core/image/exr/seal.h"
#include "core/image/frame/render_limits.h"

namespace ls {
namespace {

// Rows that are read at a time: a small file that claims a large size then costs little memory.
constexpr int kDeepBand = 16;
// No compression packs more bytes into one (headers.cpp).
constexpr std::uint64_t kMostDeepPacking = 4096;

tl::unexpected<Error> refuse_deep(const std::string& name, std::string_view what) {
  return bad_argument(fmt::format("{}: {}", name, what));
}

Result<void> check_deep_header(const Imf::Header& header, const std::string& name, DeepPicture& picture) {
  const Imath::Box2i data = header.dataWindow();
  if (!header.hasType() || header.type() != Imf::DEEPSCANLINE || data != header.displayWindow() ||
      data.min != Imath::V2i(0, 0))
    return refuse_deep(name, "it is no deep scanline image whose windows begin at 0, 0");
  const Imf::ChannelList& channels = header.channels();
  picture.colours = channels.findChannel("R") != nullptr;
  const Imf::Channel* const alpha = channels.findChannel("A");
  picture.floats = alpha && alpha->type == Imf::FLOAT;
  std::size_t count = 0;
  for (auto at = channels.begin(); at != channels.end(); ++at, ++count) {
    const std::string_view channel = at.name();
    const bool depth = channel == "Z" || channel == "ZBack";
    const bool known = depth || channel == "A" || channel == "R" || channel == "G" || channel == "B";
    if (!known || at.channel().type != (depth || picture.floats ? Imf::FLOAT : Imf::HALF))
      return refuse_deep(name,
                         fmt::format("its channel {} is none of a deep image of ours", plain_text(channel)));
  }
  if (count != (picture.colours ? 6u : 3u))
    return refuse_deep(name, "it lacks channels of a deep image of ours");
  return {};
}

// The least number of bytes that a sample has before it is packed.
std::uint64_t packed_sample(const DeepPicture& picture) {
  const std::uint64_t value = picture.floats ? 4 : 2;
  return 2 * sizeof(float) + value * (picture.colours ? 4 : 1);
}

// Reads the rows from y0 up to y1. Nothing is allocated for samples that `expected` or the length of the file
// rules out.
Result<void> read_deep_band(Imf::DeepScanLineInputFile& file, int y0, int y1, const std::string& name,
                            std::uint64_t file_bytes, const DeepExpected& expected, DeepPicture& picture) {
  const auto width = static_cast<std::size_t>(picture.rows.size.width);
  const std::size_t pixels = static_cast<std::size_t>(y1 - y0) * width;
  std::vector<std::uint32_t> counts(pixels);
  const auto base = [&](auto& values) {
    return reinterpret_cast<char*>(values.data()) - static_cast<std::size_t>(y0) * width * sizeof(values[0]);
  };
  struct Column {
    const char* name;
    std::size_t offset;
    std::vector<char*> of_pixel;
  };
  constexpr std::size_t kRgb = offsetof(DeepSample, rgb);
  std::array columns{Column{"A", offsetof(DeepSample, alpha), {}},
                     Column{"Z", offsetof(DeepSample, z), {}},
                     Column{"ZBack", offsetof(DeepSample, z_back), {}},
                     Column{"R", kRgb, {}},
                     Column{"G", kRgb + sizeof(float), {}},
                     Column{"B", kRgb + 2 * sizeof(float), {}}};
  Imf::DeepFrameBuffer buffer;
  buffer.insertSampleCountSlice(
      Imf::Slice(Imf::UINT, base(counts), sizeof counts[0], sizeof counts[0] * width));
  for (Column& column : columns) {
    if (!file.header().channels().findChannel(column.name)) continue;
    column.of_pixel.resize(pixels);
    buffer.insert(column.name, Imf::DeepSlice(Imf::FLOAT, base(column.of_pixel), sizeof(char*),
                                              sizeof(char*) * width, sizeof(DeepSample)));
  }
  file.setFrameBuffer(buffer);
  file.readPixelSampleCounts(y0, y1 - 1);
  std::size_t total = 0;
  for (const std::uint32_t count : counts) {
    if (count > expected.slices + 1)
      return refuse_deep(
          name, fmt::format("a pixel has {} samples, and there can be {}", count, expected.slices + 1));
    total += count;
  }
  const std::uint64_t all = picture.rows.samples.size() + total;
  if (all * packed_sample(picture) > kMostDeepPacking * file_bytes)
    return refuse_deep(name, fmt::format("its {} bytes cannot hold {} samples", file_bytes, all));
  if (all * sizeof(DeepSample) > expected.max_bytes)
    return fail(Errc::resource_exhausted,
                fmt::format("{}: its samples need more than {} bytes", name, expected.max_bytes));
  std::vector<DeepSample> samples(total);
  for (Column& column : columns) {
    char* at = reinterpret_cast<char*>(samples.data()) + column.offset;
    for (std::size_t i = 0; i < column.of_pixel.size(); at += sizeof(DeepSample) * counts[i++])
      column.of_pixel[i] = at;
  }
  file.readPixels(y0, y1 - 1);
  picture.rows.counts.insert(picture.rows.counts.end(), counts.begin(), counts.end());
  picture.rows.samples.insert(picture.rows.samples.end(), samples.begin(), samples.end());
  return {};
}

}  // namespace

Result<DeepPicture> read_deep_exr(std::span<const std::byte> bytes, const std::string& name,
                                  const DeepExpected& expected) {
  const ExrLimits limits{.max_bytes = std::uint64_t{1} << 36,
                         .max_pixels = static_cast<std::uint64_t>(kMaxFramePixels),
                         .max_side = kMaxFrameSide};
  if (bytes.size() > limits.max_bytes) return refuse_deep(name, "the file is larger than any image of ours");
  return exr::guarded(
      Errc::invalid_argument, fmt::format("{}: cannot read this deep EXR", name),
      [&]() -> Result<DeepPicture> {
        if (const auto ok = exr::check_headers(bytes, name, limits); !ok) return tl::unexpected(ok.error());
        exr::MemoryReader in(bytes, name);
        DeepPicture picture;
        Imf::DeepScanLineInputFile file(in, /*numThreads=*/0);
        const Imf::Header& header = file.header();
        if (const auto ok = check_deep_header(header, name, picture); !ok) return tl::unexpected(ok.error());
        const Imath::Box2i window = header.dataWindow();
        picture.rows.size = {window.max.x + 1, window.max.y + 1};
        for (auto at = header.begin(); at != header.end(); ++at)
          if (const auto* text = dynamic_cast<const Imf::StringAttribute*>(&at.attribute()))
            picture.strings.emplace(at.name(), text->value());
        if (expected.check)
          if (const auto ok = expected.check(picture); !ok) return tl::unexpected(ok.error());
        for (int y0 = 0; y0 < picture.rows.size.height; y0 += kDeepBand)
          if (auto ok = read_deep_band(file, y0, std::min(y0 + kDeepBand, picture.rows.size.height), name,
                                       bytes.size(), expected, picture);
              !ok)
            return tl::unexpected(ok.error());
        exr::Seal seal;
        seal.add(exr::values_of(picture.rows, picture.colours, !picture.floats));
        seal.add(header);
        if (const auto sealed = picture.strings.find(exr::kSealName); sealed != picture.strings.end())
          picture.changed = exr::differences(sealed->second, seal.text());
        return picture;
      });
}

}  // namespace ls
