#include "coordinator/assemble/meter_values.h"

#include <cmath>
#include <nlohmann/json.hpp>

#include "core/image/frame/meter_blocks.h"
#include "core/scene/schema/describe.h"

namespace ls::coordinator {
namespace {

// Two-sided 95 % point of Student's t with 255 degrees of freedom
constexpr double kStudent95 = 1.969310;
static_assert(kMeterPixels == 256, "kStudent95 is for this number of pixels");
// The interval is trusted if at least so many pixels carry the variance: (sum of d^2)^2 / (sum of d^4), with
// d a pixel's deviation from the mean; 85 if the deviations are Gaussian. With fewer the kurtosis of the
// pixels is above 16 and their skewness may be 4; to first order in the skewness (Edgeworth) the interval
// then misses the value in 2 % more of all cases at one side.
constexpr double kFewPixels = 16;
constexpr std::array<double, 3> kLuminance = {.212671, .715160, .072169};  // of linear sRGB

struct Moments {
  double mean = 0, half_width = 0, carrying = 0;
};
Moments moments_of(std::span<const double> x) {
  const auto n = static_cast<double>(x.size());
  Moments m;
  for (const double v : x) m.mean += v / n;
  double squares = 0, fourths = 0;
  for (const double v : x) {
    const double d = (v - m.mean) * (v - m.mean);
    squares += d;
    fourths += d * d;
  }
  m.half_width = kStudent95 * std::sqrt(squares / (n - 1) / n);
  m.carrying = fourths > 0 ? squares * squares / fourths : n;
  return m;
}

// The pixels of one block: R, G, B and luminance of each.
using Block = std::array<std::vector<double>, 4>;

MeterValue value_of(const Block& pixels) {
  MeterValue v;
  for (std::size_t c = 0; c < 3; ++c) {
    const Moments m = moments_of(pixels[c]);
    v.value[c] = m.mean;
    v.half_width[c] = m.half_width;
    for (const double x : pixels[c]) v.lit = v.lit || x != 0;
  }
  const Moments m = moments_of(pixels[3]);
  v.luminance = m.mean;
  v.luminance_half_width = m.half_width;
  v.trusted = v.lit && m.carrying >= kFewPixels;
  return v;
}

// Returns what each meter has measured. A block lies in one tile, as both begin at multiples of its side.
std::vector<MeterValue> values_of(const Film& film, std::size_t meters) {
  const MeterBlocks blocks(meters);
  const TileGrid& grid = film.grid();
  std::vector<MeterValue> values(meters);
  for (TileIndex t = 0; t < grid.count(); ++t) {
    if (film.spp(t) == 0) continue;
    const TilePixels tile = film.pixels(t);
    const PixelRect& rect = tile.rect;
    for (int top = rect.y0; top < rect.y1; top += kMeterSide)
      for (int left = rect.x0; left < rect.x1; left += kMeterSide) {
        const std::size_t meter = blocks.at(left, top);
        const PixelRect own = blocks.rect(meter);
        if (own.x0 != left || own.y0 != top) continue;  // a surplus block
        Block pixels;
        for (int y = top; y < top + kMeterSide; ++y)
          for (int x = left; x < left + kMeterSide; ++x) {
            const auto at = static_cast<std::size_t>((y - rect.y0) * rect.width() + x - rect.x0);
            double luminance = 0;
            for (std::size_t c = 0; c < 3; ++c) {
              pixels[c].push_back(tile.mean[3 * at + c]);
              luminance += kLuminance[c] * tile.mean[3 * at + c];
            }
            pixels[3].push_back(luminance);
          }
        values[meter] = value_of(pixels);
        values[meter].samples = tile.spp * kMeterPixels;
      }
  }
  return values;
}

}  // namespace

std::vector<MeterValue> meter_values(const Film& film, std::span<const MeterGroup> groups) {
  std::size_t meters = 0;
  for (const MeterGroup& g : groups) meters += g.count;
  if (meters == 0 || MeterBlocks(meters).frame() != film.grid().frame) return {};
  std::vector<MeterValue> values = values_of(film, meters);
  std::size_t next = 0;
  for (const MeterGroup& g : groups)
    for (std::uint32_t i = 0; i < g.count; ++i, ++next) {
      values[next].name = g.name_of(i);
      values[next].kind = g.kind;
    }
  return values;
}

std::string_view unit_of(MeterKind kind) {
  switch (kind) {
    case MeterKind::radiance:
      return "W/m^2/sr";
    case MeterKind::flux:
      return "W";
    case MeterKind::irradiance:
    case MeterKind::fluence:
      break;
  }
  return "W/m^2";
}

std::string meters_json(std::span<const MeterValue> values) {
  using nlohmann::json;
  json all = json::array();
  for (const MeterValue& v : values) {
    const auto interval = [&](double value, double half) {
      return v.lit ? json{value - half, value + half} : json();
    };
    json intervals;
    for (std::size_t c = 0; c < 3 && v.lit; ++c) intervals.push_back(interval(v.value[c], v.half_width[c]));
    all.push_back({{"name", v.name},
                   {"type", scene::name_of(v.kind)},
                   {"unit", unit_of(v.kind)},
                   {"value", v.value},
                   {"ci95", std::move(intervals)},
                   {"luminance", v.luminance},
                   {"luminance_ci95", interval(v.luminance, v.luminance_half_width)},
                   {"samples", v.samples},
                   {"trusted", v.trusted}});
  }
  return all.dump(-1, ' ', false, json::error_handler_t::replace);
}

}  // namespace ls::coordinator
