#include "core/image/exr/final_image.h"

#include <fmt/format.h>
#include <png.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>

#include "core/image/error/error_estimate.h"
#include "core/image/error/relative_weights.h"
#include "core/image/exr/pixel_layers.h"

namespace ls {

namespace {

using Colour = std::array<std::uint8_t, 3>;

constexpr double kMaxStops = 60;
constexpr std::size_t kChecker = 8;  // side of a square of the checkerboard, in pixels
constexpr Colour kEmpty[2] = {{24, 24, 27}, {31, 31, 35}};

// Returns the thresholds between 8-bit sRGB codes (IEC 61966-2-1): element i is the smallest linear value
// that is rounded to the code i + 1.
std::array<double, 255> srgb_steps() {
  std::array<double, 255> out;
  for (std::size_t i = 0; i < out.size(); ++i) {
    const double v = (static_cast<double>(i) + 0.5) / 255;
    out[i] = v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4);
  }
  return out;
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

Result<std::vector<std::byte>> write_png(FrameSize size, std::span<const std::uint8_t> pixels) {
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  image.width = static_cast<png_uint_32>(size.width);
  image.height = static_cast<png_uint_32>(size.height);
  image.format = pixels.size() == 4 * size.pixels() ? PNG_FORMAT_RGBA : PNG_FORMAT_RGB;
  image.flags = PNG_IMAGE_FLAG_FAST;
  png_alloc_size_t bytes = PNG_IMAGE_PNG_SIZE_MAX(image);
  std::vector<std::byte> png(bytes);
  if (!png_image_write_to_memory(&image, png.data(), &bytes, 0, pixels.data(), 0, nullptr))
    return fail(Errc::internal, fmt::format("writing a PNG: {}", image.message));
  png.resize(bytes);
  return png;
}

std::vector<std::uint8_t> srgb_codes(std::span<const double> rgb) {
  std::vector<std::uint8_t> codes(rgb.size());
  for (std::size_t i = 0; i < rgb.size(); i += 3) {
    const Colour code = srgb8(&rgb[i], 1);
    std::copy(code.begin(), code.end(), &codes[i]);
  }
  return codes;
}

Result<std::vector<std::byte>> preview_png(const Film& film, double exposure_stops,
                                           std::span<const float> denoised, const ToCodes& to_codes) {
  if (!(std::abs(exposure_stops) <= kMaxStops))
    return bad_argument(
        fmt::format("exposure: {} stops; from -{} to {} are possible", exposure_stops, kMaxStops, kMaxStops));
  const FrameSize frame = film.grid().frame;
  const auto width = static_cast<std::size_t>(frame.width);
  const double scale = std::exp2(exposure_stops);
  const bool with_alpha = film.aovs().has(Aov::alpha);
  const std::size_t channels = with_alpha ? 4 : 3;
  std::vector<std::uint8_t> out(channels * frame.pixels(), 255);
  for (TileIndex t = 0; t < film.grid().count(); ++t) {
    const TilePixels tile = film.pixels(t);
    std::vector<float> alpha;
    if (with_alpha && tile.spp > 0)
      alpha = TileLayers(film, t, true).values(pixel_layer(film.aovs(), "alpha").value());
    const auto alpha_at = [&](std::size_t from) {
      return alpha.empty() ? 1 : std::clamp(double{alpha[from]}, 0., 1.);
    };
    std::vector<double> rgb(tile.mean.size());
    each_pixel(tile.rect, frame, [&](std::size_t to, std::size_t from) {
      // The colours of a PNG are not multiplied by alpha.
      const double a = alpha_at(from), factor = a > 0 ? scale / a : 0;
      for (std::size_t c = 0; c < 3; ++c) {
        const double value = denoised.empty() ? tile.mean[3 * from + c] : denoised[3 * to + c];
        rgb[3 * from + c] = a > 0 ? value * factor : 0;
      }
    });
    const std::vector<std::uint8_t> codes = tile.spp > 0 ? to_codes(rgb) : std::vector<std::uint8_t>();
    each_pixel(tile.rect, frame, [&](std::size_t to, std::size_t from) {
      std::uint8_t* pixel = &out[channels * to];
      if (tile.spp == 0) {
        const Colour& empty = kEmpty[(to % width / kChecker + to / width / kChecker) % 2];
        std::copy(empty.begin(), empty.end(), pixel);
        return;
      }
      const double a = alpha_at(from);
      std::copy_n(&codes[3 * from], 3, pixel);
      if (!(a > 0)) std::fill_n(pixel, 3, std::uint8_t{0});
      if (with_alpha) pixel[3] = static_cast<std::uint8_t>(std::lround(255 * a));
    });
  }
  return write_png(frame, out);
}

namespace {

// A function that draws one tile: it returns one colour per pixel, row by row.
using DrawTile = std::function<std::vector<Colour>(TileIndex, const TilePixels&)>;
Result<std::vector<std::byte>> drawn(const Film& film, const DrawTile& draw) {
  const FrameSize frame = film.grid().frame;
  std::vector<std::uint8_t> rgb(3 * frame.pixels());
  for (TileIndex t = 0; t < film.grid().count(); ++t) {
    const TilePixels tile = film.pixels(t);
    const std::vector<Colour> colours = draw(t, tile);
    each_pixel(tile.rect, frame, [&](std::size_t to, std::size_t from) {
      std::copy_n(colours[from].begin(), 3, &rgb[3 * to]);
    });
  }
  return write_png(frame, rgb);
}

// Draws a map of the film: `draw` draws the tiles that have samples, all other tiles are grey.
Result<std::vector<std::byte>> map_png(const Film& film, const DrawTile& draw) {
  return drawn(film, [&](TileIndex t, const TilePixels& tile) {
    return tile.spp == 0 ? std::vector<Colour>(tile.mean.size() / 3, kNoSampleColour) : draw(t, tile);
  });
}

double ramp(double value, double least, double most) {
  return value > least ? std::log(value / least) / std::log(most / least) : 0;
}

// For each pixel, the mean over channels of the squared relative error, and whether too few of its samples
// found light for a reliable error (has_few_hits()).
struct PixelErrors {
  std::vector<double> squared;
  std::vector<char> few_hits;
};

PixelErrors pixel_errors(const TilePixels& tile, const HalfMeans& halves) {
  const auto n = tile.mean.size() / 3;
  PixelErrors out{std::vector<double>(n), std::vector<char>(n)};
  for (std::size_t p = 0; p < n; ++p) {
    for (std::size_t c = 0; c < 3; ++c) {
      const double d = tile.standard_error[3 * p + c], m = tile.mean[3 * p + c];
      out.squared[p] += d * d / (m * m + kRelMseDenominator) / 3;
    }
    const int x = static_cast<int>(p) % halves.width, y = static_cast<int>(p) / halves.width;
    out.few_hits[p] = has_few_hits(halves, x, y);
  }
  return out;
}

double averaged(const std::vector<double>& values, const PixelRect& rect, std::size_t pixel) {
  const int x = static_cast<int>(pixel) % rect.width(), y = static_cast<int>(pixel) / rect.width();
  double sum = 0;
  int count = 0;
  for (int j = std::max(0, y - 1); j <= std::min(rect.height() - 1, y + 1); ++j)
    for (int i = std::max(0, x - 1); i <= std::min(rect.width() - 1, x + 1); ++i, ++count)
      sum += values[static_cast<std::size_t>(j) * static_cast<std::size_t>(rect.width()) +
                    static_cast<std::size_t>(i)];
  return sum / count;
}

}  // namespace

Colour map_colour(double t) {
  // Dark blue, blue, green, yellow. Lightness increases evenly, so the order is visible without colour, too.
  constexpr std::array<Colour, 5> kStops = {
      {{13, 8, 70}, {45, 60, 142}, {33, 120, 140}, {70, 180, 105}, {250, 230, 50}}};
  const double at = std::clamp(std::isnan(t) ? 1.0 : t, 0.0, 1.0) * (kStops.size() - 1);
  const auto below = std::min(static_cast<std::size_t>(at), kStops.size() - 2);
  const double part = at - static_cast<double>(below);
  Colour out;
  for (std::size_t c = 0; c < 3; ++c)
    out[c] =
        static_cast<std::uint8_t>(std::lround((1 - part) * kStops[below][c] + part * kStops[below + 1][c]));
  return out;
}

Result<std::vector<std::byte>> error_map_png(const Film& film) {
  return map_png(film, [&](TileIndex index, const TilePixels& tile) {
    const auto means = film.half_means(index);
    const HalfMeans halves{tile.rect.width(), tile.rect.height(), means[0], means[1]};
    const PixelErrors errors = pixel_errors(tile, halves);
    std::vector<Colour> out(errors.squared.size());
    for (std::size_t p = 0; p < out.size(); ++p) {
      const double error = std::sqrt(averaged(errors.squared, tile.rect, p));
      out[p] = errors.few_hits[p] ? kFewHitsColour : map_colour(ramp(error, kMapLeastError, kMapMostError));
    }
    return out;
  });
}

Result<std::vector<std::byte>> samples_map_png(const Film& film) {
  return map_png(film, [](TileIndex, const TilePixels& tile) {
    const double height = ramp(static_cast<double>(tile.spp), kMapLeastSamples, kMapMostSamples);
    return std::vector<Colour>(tile.mean.size() / 3, map_colour(height));
  });
}

}  // namespace ls
