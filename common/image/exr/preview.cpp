#include <fmt/format.h>
#include <png.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "common/image/exr/final_image.h"

namespace ls {
namespace {

constexpr double kMaxStops = 60;
constexpr int kChecker = 8;  // side of a square of the checkerboard, in pixels
constexpr std::array<png_byte, 3> kEmpty[2] = {{24, 24, 27}, {31, 31, 35}};

// Returns the thresholds between 8-bit sRGB codes: the i-th is the smallest linear value that is rounded to
// the code i + 1 (IEC 61966-2-1).
std::array<double, 255> srgb_steps() {
  std::array<double, 255> out;
  for (std::size_t i = 0; i < out.size(); ++i) {
    const double v = (static_cast<double>(i) + 0.5) / 255;
    out[i] = v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4);
  }
  return out;
}

void draw_tile(const Film& film, TileIndex index, double scale, std::span<const float> denoised,
               png_byte* image) {
  const TilePixels tile = film.pixels(index);
  const auto width = static_cast<std::size_t>(film.grid().frame.width);
  std::size_t from = 0;
  for (int y = tile.rect.y0; y < tile.rect.y1; ++y) {
    std::size_t at = (static_cast<std::size_t>(y) * width + static_cast<std::size_t>(tile.rect.x0)) * 3;
    for (int x = tile.rect.x0; x < tile.rect.x1; ++x, at += 3, from += 3) {
      std::array<double, 3> rgb = {tile.mean[from], tile.mean[from + 1], tile.mean[from + 2]};
      if (!denoised.empty()) std::copy_n(&denoised[at], 3, rgb.begin());
      const auto shown = tile.spp == 0 ? kEmpty[(x / kChecker + y / kChecker) % 2] : srgb8(rgb.data(), scale);
      std::copy(shown.begin(), shown.end(), image + at);
    }
  }
}

}  // namespace

std::array<std::uint8_t, 3> srgb8(const double* rgb, double scale) {
  static const std::array<double, 255> kSteps = srgb_steps();
  if (std::isnan(rgb[0]) || std::isnan(rgb[1]) || std::isnan(rgb[2])) return {255, 0, 255};
  std::array<std::uint8_t, 3> out;
  for (std::size_t c = 0; c < 3; ++c)
    out[c] = static_cast<std::uint8_t>(std::upper_bound(kSteps.begin(), kSteps.end(), rgb[c] * scale) -
                                       kSteps.begin());
  return out;
}

Result<std::vector<std::byte>> write_png(FrameSize size, std::span<const std::uint8_t> rgb) {
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  image.width = static_cast<png_uint_32>(size.width);
  image.height = static_cast<png_uint_32>(size.height);
  image.format = PNG_FORMAT_RGB;
  image.flags = PNG_IMAGE_FLAG_FAST;
  png_alloc_size_t bytes = PNG_IMAGE_PNG_SIZE_MAX(image);
  std::vector<std::byte> png(bytes);
  if (!png_image_write_to_memory(&image, png.data(), &bytes, 0, rgb.data(), 0, nullptr))
    return fail(Errc::internal, fmt::format("writing a PNG: {}", image.message));
  png.resize(bytes);
  return png;
}

Result<std::vector<std::byte>> preview_png(const Film& film, double exposure_stops,
                                           std::span<const float> denoised) {
  if (!(std::abs(exposure_stops) <= kMaxStops))
    return fail(Errc::invalid_argument, fmt::format("exposure: {} stops; from -{} to {} are possible",
                                                    exposure_stops, kMaxStops, kMaxStops));
  const FrameSize frame = film.grid().frame;
  std::vector<png_byte> pixels(static_cast<std::size_t>(frame.width) *
                               static_cast<std::size_t>(frame.height) * 3);
  for (TileIndex t = 0; t < film.grid().count(); ++t)
    draw_tile(film, t, std::exp2(exposure_stops), denoised, pixels.data());
  return write_png(frame, pixels);
}

}  // namespace ls
