// The texels of one image in the form used for lookup. 8-bit values are stored as they are (a table decodes
// them before filtering); all other formats become linear float32. Grey images keep one channel.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>
#include <vector>

#include "core/assets/data.h"
#include "core/scene/scene.h"
#include "worker/render/math/math.h"

namespace ls::render {

// Decodes an sRGB component (IEC 61966-2-1); exactly 0 at 0 and 1 at 1.
double srgb_to_linear(double v);

// What an image's values are. Colours are converted to linear sRGB and are not negative. Numbers are not
// negative either, but no conversion of colours changes them. Heights may have any sign.
enum class Content : std::uint8_t { colours, numbers, heights };

struct Texels {
  std::uint32_t width = 0, height = 0, channels = 3;  // 1 channel (grey) or 3 (RGB)
  std::vector<std::uint8_t> u8;                       // either u8 or f32 holds the texels; the other is empty
  std::vector<float> f32;
  std::array<float, 256> decode{};  // the linear value of each 8-bit value
  C3 mean{0, 0, 0};
  std::uint64_t clamped = 0;  // number of negative values that were set to 0

  C3 texel(std::uint32_t x, std::uint32_t y) const {
    const std::size_t i = (static_cast<std::size_t>(y) * width + x) * channels;
    if (!u8.empty()) {
      if (channels == 1) return C3(decode[u8[i]]);
      return {decode[u8[i]], decode[u8[i + 1]], decode[u8[i + 2]]};
    }
    if (channels == 1) return C3(f32[i]);
    return {f32[i], f32[i + 1], f32[i + 2]};
  }
  // Returns the filtered value at uv, which must be finite; (0, 0) is the upper left corner of the image.
  C3 lookup(const V2& uv, TextureFilter filter, Wrap wrap) const;
  // Returns the derivatives by u and v of the luminance of a bilinear lookup().
  V2 slope(const V2& uv, Wrap wrap) const;
};

// Returns the image with these colours instead of those that its file says (ImageColours). Curves other than
// that of sRGB are undone here, alpha excepted; the others by make_texels().
ImageData with_colours(ImageData image, ImageColours colours);

// Makes texels of `image`; `name` is for messages. Drops the alpha channel, decodes sRGB unless `raw` is set,
// converts other colours by ImageData::to_srgb (whatever `raw` says, as Mitsuba does), and fails on NaN and
// infinity with a message that names the texel. Negative values become 0 unless they are heights. If `alpha`
// is set and the image has an alpha channel that is below 1/2 somewhere, that channel is kept and the colour
// dropped. If `channel` selects one channel, only that one is kept, and it is not decoded; a missing alpha
// channel is 1 everywhere.
Result<Texels> make_texels(std::string_view name, ImageData image, bool raw, bool alpha = false,
                           Channel channel = Channel::all, Content content = Content::colours);

}  // namespace ls::render
