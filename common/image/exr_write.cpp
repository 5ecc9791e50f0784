#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfOutputFile.h>
#include <ImfStringAttribute.h>
#include <half.h>

#include "common/base/overloaded.h"
#include "common/image/exr_file.h"
#include "common/image/exr_memory.h"

namespace ls {
namespace {

constexpr int kZipLevel = 2;  // noise hardly shrinks further, and an image may be asked for at any moment

std::vector<half> to_half(const std::vector<float>& values) {
  std::vector<half> out(values.size());
  for (std::size_t i = 0; i < values.size(); ++i) out[i] = half(values[i]);
  return out;
}

}  // namespace

Result<std::vector<std::byte>> write_exr(const ExrPicture& picture) {
  const FrameSize size = picture.size;
  if (size.width < 1 || size.height < 1)
    return fail(Errc::invalid_argument, "writing an EXR: the image is empty");
  const auto pixels = static_cast<std::size_t>(size.width) * static_cast<std::size_t>(size.height);
  for (const auto& [name, channel] : picture.channels)
    if (std::visit([](const auto& c) { return c.values.size(); }, channel) != pixels)
      return fail(Errc::internal, fmt::format("writing an EXR: channel {} has the wrong size", name));

  return exr::guarded(Errc::internal, "writing an EXR", [&]() -> Result<std::vector<std::byte>> {
    Imf::Header header(size.width, size.height, 1, {0, 0}, 1, Imf::INCREASING_Y, Imf::ZIP_COMPRESSION);
    header.zipCompressionLevel() = kZipLevel;
    for (const auto& [name, text] : picture.strings) header.insert(name, Imf::StringAttribute(text));
    Imf::FrameBuffer buffer;
    std::vector<std::vector<half>> halves;  // moved, not copied, when it grows: the slices stay valid
    const auto add = [&](const std::string& name, Imf::PixelType type, const void* data) {
      header.channels().insert(name, Imf::Channel(type));
      buffer.insert(name, Imf::Slice::Make(type, data, {0, 0}, size.width, size.height));
    };
    for (const auto& entry : picture.channels) {
      const std::string& name = entry.first;
      std::visit(overloaded{[&](const ExrHalf& c) {
                              add(name, Imf::HALF, halves.emplace_back(to_half(c.values)).data());
                            },
                            [&](const ExrFloat& c) { add(name, Imf::FLOAT, c.values.data()); },
                            [&](const ExrUint& c) { add(name, Imf::UINT, c.values.data()); }},
                 entry.second);
    }
    exr::MemoryWriter out;
    {
      Imf::OutputFile file(out, header, /*numThreads=*/0);
      file.setFrameBuffer(buffer);
      file.writePixels(size.height);
    }
    return out.take();
  });
}

}  // namespace ls
