#include "worker/render/texture/texels.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "core/base/light/colour_space.h"
#include "core/scene/schema/describe.h"
#include "worker/render/base/work_counters.h"

namespace ls::render {

double srgb_to_linear(double v) { return v <= .04045 ? v / 12.92 : std::pow((v + .055) / 1.055, 2.4); }

namespace {

// Wraps one coordinate into [0, 1], for any finite u.
float fold(float u, Wrap wrap) {
  switch (wrap) {
    case Wrap::repeat:
      return u - std::floor(u);
    case Wrap::mirror: {
      const float t = u - 2 * std::floor(u * .5f);  // position in the period of mirroring, [0, 2]
      return t > 1 ? 2 - t : t;
    }
    case Wrap::clamp:
      break;
  }
  return std::clamp(u, 0.f, 1.f);
}

// The derivative of fold() by u. For Wrap::clamp it returns 1 even outside of [0, 1], where fold() is
// constant. That does no harm: both neighbours() are the same texel there, so slopes are 0 anyway.
float fold_slope(float u, Wrap wrap) {
  return wrap == Wrap::mirror && u - 2 * std::floor(u * .5f) > 1 ? -1.f : 1.f;
}

struct Span2 {
  std::uint32_t lo, hi;
  float t;  // weight of `hi`; `lo` has the weight 1 - t
};
// Returns the indices (0 to n - 1) of the two texels whose centres are on either side of u in [0, 1]. If one
// of them would lie beyond the image's edge, the texel at the opposite edge takes its place when repeating,
// else the texel at the edge itself (also when mirroring, since texel -1 mirrors to texel 0).
Span2 neighbours(float u, std::uint32_t n, Wrap wrap) {
  const float x = u * static_cast<float>(n) - .5f, f = std::floor(x);
  const std::int64_t lo = static_cast<std::int64_t>(f), last = n - 1;
  const auto at = [&](std::int64_t i) {
    if (wrap == Wrap::repeat) return static_cast<std::uint32_t>(i < 0 ? last : i > last ? 0 : i);
    return static_cast<std::uint32_t>(std::clamp<std::int64_t>(i, 0, last));
  };
  return {at(std::min(lo, last)), at(std::min(lo, last) + 1), x - f};
}

std::uint32_t nearest(float u, std::uint32_t n) {
  return std::min(static_cast<std::uint32_t>(u * static_cast<float>(n)), n - 1);
}

C3 mean_of(const Texels& t) {
  double sum[3] = {0, 0, 0};
  for (std::uint32_t y = 0; y < t.height; ++y)
    for (std::uint32_t x = 0; x < t.width; ++x) {
      const C3 c = t.texel(x, y);
      for (int k = 0; k < 3; ++k) sum[k] += c[k];
    }
  const double n = static_cast<double>(t.width) * t.height;
  return {static_cast<float>(sum[0] / n), static_cast<float>(sum[1] / n), static_cast<float>(sum[2] / n)};
}

// Removes from v, which has `have` interleaved channels per pixel, all channels but the `keep` channels from
// number `first` on.
template <class T>
void drop_channels(std::vector<T>& v, std::uint32_t have, std::uint32_t first, std::uint32_t keep) {
  if (have == keep) return;
  const std::size_t n = v.size() / have;
  for (std::size_t i = 0; i < n; ++i)
    for (std::uint32_t k = 0; k < keep; ++k) v[i * keep + k] = v[i * have + first + k];
  v.resize(n * keep);
  v.shrink_to_fit();
}

// Reduces an image to one of its channels. If the alpha channel is wanted and the image has none, the result
// is one pixel of value 1. The red, green and blue channels of a grey image are all its grey.
void keep_channel(ImageData& image, Channel channel) {
  const bool has_alpha = image.channels % 2 == 0, is_grey = image.channels < 3;
  if (channel == Channel::alpha && !has_alpha) {
    image = ImageData{.width = 1, .height = 1, .channels = 1, .u8 = {}, .f32 = {1}};
    return;
  }
  const std::uint32_t first = channel == Channel::alpha   ? image.channels - 1
                              : is_grey                   ? 0
                              : channel == Channel::green ? 1
                              : channel == Channel::blue  ? 2
                                                          : 0;
  drop_channels(image.u8, image.channels, first, 1);
  drop_channels(image.f32, image.channels, first, 1);
  image.channels = 1;
}

// True if the last channel is an alpha channel that serves as a mask, that is, one that is below 1/2
// somewhere. An alpha channel that is 1/2 or more everywhere is not used as a mask: in some images the colour
// is the mask, and the alpha channel is nearly opaque.
bool has_alpha(const ImageData& image) {
  if (image.channels % 2) return false;
  const auto transparent = [&](const auto& v, auto half) {
    for (std::size_t i = image.channels - 1; i < v.size(); i += image.channels)
      if (v[i] < half) return true;
    return false;
  };
  return transparent(image.u8, std::uint8_t{128}) || transparent(image.f32, .5f);
}

// How the colours of an image are stored, other than in linear Rec. 709 or by the curve of sRGB.
using Matrix9 = std::array<float, 9>;
constexpr Matrix9 kIdentity{1, 0, 0, 0, 1, 0, 0, 0, 1};
struct Encoding {
  Matrix9 matrix = kIdentity;               // from its linear colours to linear Rec. 709
  double (*to_linear)(double v) = nullptr;  // null: the values are linear
};

// A power of the value, mirrored below 0
template <int numerator, int denominator>
double power(double v) {
  return std::copysign(std::pow(std::abs(v), static_cast<double>(numerator) / denominator), v);
}
double mirrored_srgb(double v) { return std::copysign(srgb_to_linear(std::abs(v)), v); }

constexpr double kLargestAces = 65504;  // of ACEScc and ACEScct: the largest number of a half float
double stops(double v) { return std::min(std::exp2(v * 17.52 - 9.72), kLargestAces); }
// ACEScc: S-2014-003, section 4.4.2
double acescc_to_linear(double v) {
  return v <= (9.72 - 15) / 17.52 ? (std::exp2(v * 17.52 - 9.72) - 0x1p-16) * 2 : stops(v);
}
// ACEScct: S-2016-001, section 4.4.2
double acescct_to_linear(double v) {
  return v <= .155251141552511 ? (v - .0729055341958355) / 10.5402377416545 : stops(v);
}

Matrix9 to_rec709(const ColourMatrix& from) {
  const ColourMatrix m = inverse(from);
  Matrix9 matrix;
  for (std::size_t i = 0; i < 9; ++i) matrix[i] = static_cast<float>(m(i / 3, i % 3));
  return matrix;
}
Matrix9 to_rec709(ColourSpace space) { return to_rec709(from_rec709(space)); }

Encoding encoding_of(ImageColours colours) {
  switch (colours) {
    case ImageColours::automatic:
    case ImageColours::srgb:
    case ImageColours::rec709:
      return {};
    case ImageColours::rec2020:
      return {to_rec709(ColourSpace::rec2020)};
    case ImageColours::p3_d65:
      return {to_rec709(ColourSpace::p3_d65)};
    case ImageColours::acescg:
      return {to_rec709(ColourSpace::acescg)};
    case ImageColours::aces2065_1:
      return {to_rec709(ColourSpace::aces2065_1)};
    case ImageColours::xyz:
      return {to_rec709(ColourSpace::xyz)};
    case ImageColours::adobe_linear:
      return {to_rec709(from_rec709(kAdobeRgb))};
    case ImageColours::g18_rec709:
      return {kIdentity, power<18, 10>};
    case ImageColours::g22_rec709:
      return {kIdentity, power<22, 10>};
    case ImageColours::g24_rec709:
      return {kIdentity, power<24, 10>};
    case ImageColours::g22_ap1:
      return {to_rec709(ColourSpace::acescg), power<22, 10>};
    case ImageColours::adobe:  // 2.19921875: Adobe RGB (1998) Color Image Encoding, section 4.3.4.2
      return {to_rec709(from_rec709(kAdobeRgb)), power<563, 256>};
    case ImageColours::srgb_ap1:
      return {to_rec709(ColourSpace::acescg), mirrored_srgb};
    case ImageColours::srgb_p3_d65:
      return {to_rec709(ColourSpace::p3_d65), mirrored_srgb};
    case ImageColours::acescc:
      return {to_rec709(ColourSpace::acescg), acescc_to_linear};
    case ImageColours::acescct:
      return {to_rec709(ColourSpace::acescg), acescct_to_linear};
  }
  return {};
}

// Replaces the colours of t, which has three channels of floats, by those of linear sRGB.
Result<void> convert(std::string_view name, Texels& t, const std::array<float, 9>& m) {
  if (!std::ranges::all_of(m, [](float x) { return std::isfinite(x); }))
    return fail(Errc::invalid_argument, fmt::format("texture '{}': the `chromaticities` in its header are "
                                                    "those of no colour space; write the file again",
                                                    name));
  for (std::size_t i = 0; i + 2 < t.f32.size(); i += 3) {
    const float r = t.f32[i], g = t.f32[i + 1], b = t.f32[i + 2];
    for (std::size_t k = 0; k < 3; ++k) t.f32[i + k] = m[3 * k] * r + m[3 * k + 1] * g + m[3 * k + 2] * b;
  }
  return {};
}

// Fails if a texel is not finite. Unless `signed_values`, negative values become 0 and are counted.
Result<void> check_texels(std::string_view name, Texels& t, bool signed_values) {
  for (std::size_t i = 0; i < t.f32.size(); ++i) {
    float& v = t.f32[i];
    if (!std::isfinite(v)) {
      const std::size_t p = i / t.channels;
      return fail(
          Errc::invalid_argument,
          fmt::format("texture '{}': the texel at x {}, y {} (from the top left) is {}; repair the image",
                      name, p % t.width, p / t.width, std::isnan(v) ? "not a number" : "infinite"));
    }
    if (v < 0 && !signed_values) {
      v = 0;
      ++t.clamped;
    }
  }
  return {};
}

}  // namespace

ImageData with_colours(ImageData image, ImageColours colours) {
  if (colours == ImageColours::automatic) return image;
  image.srgb = colours == ImageColours::srgb;
  image.to_srgb.reset();
  const Encoding encoding = encoding_of(colours);
  if (encoding.matrix == kIdentity && !encoding.to_linear) return image;
  image.f32.insert(image.f32.end(), image.u8.begin(), image.u8.end());
  if (!image.u8.empty())
    for (float& v : image.f32) v /= 255;
  image.u8.clear();
  if (encoding.to_linear) {
    const bool alpha = image.channels % 2 == 0;
    for (std::size_t i = 0; i < image.f32.size(); ++i)
      if (!alpha || (i + 1) % image.channels != 0)
        image.f32[i] = static_cast<float>(encoding.to_linear(image.f32[i]));
  }
  if (encoding.matrix != kIdentity) image.to_srgb = encoding.matrix;
  return image;
}

C3 Texels::lookup(const V2& uv, TextureFilter filter, Wrap wrap) const {
  LS_COUNT(texels);
  const float u = fold(uv.x, wrap), v = fold(uv.y, wrap);
  if (filter == TextureFilter::nearest) return texel(nearest(u, width), nearest(v, height));
  const Span2 x = neighbours(u, width, wrap), y = neighbours(v, height, wrap);
  const C3 top = texel(x.lo, y.lo) * (1 - x.t) + texel(x.hi, y.lo) * x.t;
  const C3 bottom = texel(x.lo, y.hi) * (1 - x.t) + texel(x.hi, y.hi) * x.t;
  return top * (1 - y.t) + bottom * y.t;
}

V2 Texels::slope(const V2& uv, Wrap wrap) const {
  LS_COUNT(texels);
  const Span2 x = neighbours(fold(uv.x, wrap), width, wrap), y = neighbours(fold(uv.y, wrap), height, wrap);
  const float f00 = luminance(texel(x.lo, y.lo)), f10 = luminance(texel(x.hi, y.lo)),
              f01 = luminance(texel(x.lo, y.hi)), f11 = luminance(texel(x.hi, y.hi));
  const float across = (f10 - f00) * (1 - y.t) + (f11 - f01) * y.t;
  const float down = (f01 - f00) * (1 - x.t) + (f11 - f10) * x.t;
  return {across * static_cast<float>(width) * fold_slope(uv.x, wrap),
          down * static_cast<float>(height) * fold_slope(uv.y, wrap)};
}

Result<Texels> make_texels(std::string_view name, ImageData image, bool raw, bool alpha, Channel channel,
                           Content content) {
  const std::uint64_t values = std::uint64_t{image.width} * image.height * image.channels;
  if (values == 0 || image.channels > 4 || (image.u8.empty() ? image.f32.size() : image.u8.size()) != values)
    return fail(Errc::invalid_argument, fmt::format("texture '{}' has no pixels", name));
  if (channel != Channel::all) {
    keep_channel(image, channel);
    raw = true;
  }
  alpha = alpha && has_alpha(image);
  const std::uint32_t keep = image.channels < 3 || alpha ? 1 : 3, first = alpha ? image.channels - 1 : 0;
  Texels t;
  t.width = image.width;
  t.height = image.height;
  t.channels = keep;
  const bool decode = image.srgb && !raw && !alpha;
  for (int i = 0; i < 256; ++i)
    t.decode[i] = static_cast<float>(decode ? srgb_to_linear(i / 255.) : i / 255.);
  t.u8 = std::move(image.u8);
  t.f32 = std::move(image.f32);
  drop_channels(t.u8, image.channels, first, keep);
  drop_channels(t.f32, image.channels, first, keep);
  if (image.to_srgb && t.channels == 3 && content == Content::colours)
    if (auto ok = convert(name, t, *image.to_srgb); !ok) return tl::unexpected(ok.error());
  if (decode)  // before the check: the curve makes large numbers infinite
    for (float& v : t.f32) v = static_cast<float>(srgb_to_linear(v));
  if (auto ok = check_texels(name, t, content == Content::heights); !ok) return tl::unexpected(ok.error());
  t.mean = mean_of(t);
  return t;
}

}  // namespace ls::render
