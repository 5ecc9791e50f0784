// Encodes partials (files with the pixel sums of one tile and range of samples) with OpenEXR.
// partial_decoder.cpp decodes them without the library, since they are untrusted input of one fixed form.
#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfOutputFile.h>
#include <ImfStringAttribute.h>

#include "common/image/exr/memory.h"
#include "common/image/exr/partial_decoder.h"
#include "common/image/film/partial.h"

namespace ls {
namespace {

Result<void> check(const Partial& partial, FrameSize frame) {
  const PixelRect& t = partial.header.tile;
  if (t.x0 < 0 || t.y0 < 0 || t.x0 >= t.x1 || t.y0 >= t.y1 || t.x1 > frame.width || t.y1 > frame.height)
    return fail(Errc::invalid_argument,
                fmt::format("partial: tile [{},{},{},{}] does not lie in the frame {}x{}", t.x0, t.y0, t.x1,
                            t.y1, frame.width, frame.height));
  if (t.pixels() > kMaxPartialPixels)
    return fail(Errc::invalid_argument,
                fmt::format("partial: tile of {} pixels, the limit is {}", t.pixels(), kMaxPartialPixels));
  const auto want =
      static_cast<std::uint64_t>(t.pixels()) * (kPartialChannels + planes_of(partial.aovs).count());
  if (partial.sums.size() != want)
    return fail(Errc::invalid_argument,
                fmt::format("partial: {} sums, the tile needs {}", partial.sums.size(), want));
  if (const auto finite = all_finite(partial); !finite) return finite;
  if (const auto possible = counts_possible(partial); !possible) return possible;
  return {};
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
