// Reads a final EXR that this program has written.
#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfInputFile.h>
#include <ImfPartType.h>
#include <ImfStringAttribute.h>
#include <half.h>

#include <algorithm>

#include "common/image/exr/final_image.h"
#include "common/image/exr/headers.h"
#include "common/image/exr/memory.h"
#include "common/image/exr/seal.h"
#include "common/image/frame/render_limits.h"

namespace ls {
namespace {

constexpr const char* kColours[3] = {"R", "G", "B"};
constexpr const char* kErrors[3] = {"stderr.R", "stderr.G", "stderr.B"};
constexpr std::size_t kMaxLayers = 128;  // all AOVs together have 74 layers, denoising adds 3

tl::unexpected<Error> bad(const std::string& name, const std::string& what) {
  return fail(Errc::invalid_argument, fmt::format("{}: {}", name, what));
}

Result<void> check_layers(const Imf::Header& header, const std::string& name, FinalPicture& image) {
  for (const char* colour : kColours) {
    const Imf::Channel* channel = header.channels().findChannel(colour);
    if (!channel || channel->type == Imf::UINT || channel->xSampling != 1 || channel->ySampling != 1)
      return bad(name, fmt::format("it has no layer {} of half or float", colour));
    image.half = channel->type == Imf::HALF;
  }
  const Imf::Channel* spp = header.channels().findChannel("spp");
  if (!spp || spp->type != Imf::UINT || spp->xSampling != 1 || spp->ySampling != 1)
    return bad(name, "it has no layer spp of integers");
  for (const char* error : kErrors) {
    const Imf::Channel* channel = header.channels().findChannel(error);
    if (!channel || channel->type != Imf::FLOAT || channel->xSampling != 1 || channel->ySampling != 1)
      return bad(name, fmt::format("it has no layer {} of floats", error));
  }
  std::size_t layers = 0;
  for (auto at = header.channels().begin(); at != header.channels().end(); ++at) {
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

// Reads some rows of every layer.
ExrPicture read_rows(Imf::InputFile& file, int width, int y0, int rows) {
  ExrPicture band{{width, rows}, {}, {}};
  Imf::FrameBuffer buffer;
  const Imf::ChannelList& list = file.header().channels();
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
  file.setFrameBuffer(buffer);
  file.readPixels(y0, y0 + rows - 1);
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
void read_pixels(Imf::InputFile& file, FinalPicture& image) {
  constexpr int kBand = 64;
  exr::Seal seal;
  for (int y0 = 0; y0 < image.size.height; y0 += kBand) {
    const ExrPicture band = read_rows(file, image.size.width, y0, std::min(kBand, image.size.height - y0));
    seal.add(band);
    append(band, image);
  }
  seal.add(file.header());
  if (const auto sealed = image.strings.find(exr::kSealName); sealed != image.strings.end())
    image.changed = exr::differences(sealed->second, seal.text());
}

Result<FinalPicture> read(std::span<const std::byte> exr, const std::string& name) {
  const ExrLimits limits{.max_bytes = kMaxFinalBytes,
                         .max_pixels = static_cast<std::uint64_t>(kMaxFramePixels),
                         .max_side = kMaxFrameSide};
  if (exr.size() > limits.max_bytes) return bad(name, "the file is larger than any image of ours");
  if (const auto ok = exr::check_headers(exr, name, limits); !ok) return tl::unexpected(ok.error());
  exr::MemoryReader in(exr, name);
  Imf::InputFile file(in, /*numThreads=*/0);
  const Imf::Header& header = file.header();
  const Imath::Box2i data = header.dataWindow();
  if ((header.hasType() && header.type() != Imf::SCANLINEIMAGE) || data != header.displayWindow() ||
      data.min != Imath::V2i(0, 0))
    return bad(name, "it is no scanline image whose windows begin at 0, 0");
  FinalPicture image;
  image.size = {data.max.x + 1, data.max.y + 1};
  if (const auto ok = check_layers(header, name, image); !ok) return tl::unexpected(ok.error());
  for (auto at = header.begin(); at != header.end(); ++at)
    if (const auto* text = dynamic_cast<const Imf::StringAttribute*>(&at.attribute()))
      image.strings.emplace(at.name(), text->value());
  read_pixels(file, image);
  return image;
}

}  // namespace

float as_half(float value) { return half(value); }

Result<FinalPicture> read_final_exr(std::span<const std::byte> exr, const std::string& name) {
  return exr::guarded(Errc::invalid_argument, fmt::format("{}: cannot read this EXR", name),
                      [&] { return read(exr, name); });
}

}  // namespace ls
