#include "common/image/exr/maps.h"

#include <algorithm>
#include <cmath>
#include <functional>

#include "common/image/error/error_estimate.h"
#include "common/image/error/relative_weights.h"
#include "common/image/exr/final_image.h"

namespace ls {
namespace {

using Colour = std::array<std::uint8_t, 3>;

double ramp(double value, double least, double most) {
  return value > least ? std::log(value / least) / std::log(most / least) : 0;
}

// Draws one tile of a map: returns one colour per pixel, row by row.
using DrawTile = std::function<std::vector<Colour>(TileIndex, const TilePixels&)>;
Result<std::vector<std::byte>> drawn(const Film& film, const DrawTile& draw) {
  const FrameSize frame = film.grid().frame;
  const auto width = static_cast<std::size_t>(frame.width);
  std::vector<std::uint8_t> rgb(3 * width * static_cast<std::size_t>(frame.height));
  for (TileIndex t = 0; t < film.grid().count(); ++t) {
    const TilePixels tile = film.pixels(t);
    const std::vector<Colour> colours =
        tile.spp == 0 ? std::vector<Colour>(tile.mean.size() / 3, kNoSampleColour) : draw(t, tile);
    auto from = colours.begin();
    for (int y = tile.rect.y0; y < tile.rect.y1; ++y)
      for (int x = tile.rect.x0; x < tile.rect.x1; ++x, ++from)
        std::copy_n(from->begin(), 3,
                    &rgb[3 * (static_cast<std::size_t>(y) * width + static_cast<std::size_t>(x))]);
  }
  return write_png(frame, rgb);
}

// For each pixel, the mean over channels of its squared relative error, and whether it has few hits.
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
  return drawn(film, [&](TileIndex index, const TilePixels& tile) {
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
  return drawn(film, [](TileIndex, const TilePixels& tile) {
    const double height = ramp(static_cast<double>(tile.spp), kMapLeastSamples, kMapMostSamples);
    return std::vector<Colour>(tile.mean.size() / 3, map_colour(height));
  });
}

}  // namespace ls
