#include "core/image/error/area_error.h"

#include <algorithm>
#include <cmath>

#include "core/image/error/error_estimate.h"
#include "core/image/error/relative_weights.h"

namespace ls {
namespace {

// The two-sided 95 % points of Student's distribution with one and with two degrees of freedom: tan(0.95 pi /
// 2), and 0.95 sqrt(2 / (1 - 0.95^2)).
constexpr double kOneDegree = 12.706204736432095, kTwoDegrees = 4.302652729911275;
// The interval of squares is known if at least this many carry their error.
constexpr double kFewestSquares = 4;

// The two-sided 95 % point of Student's distribution, to third order in 1 / degrees of freedom (Abramowitz
// and Stegun 26.7.5). That is too small for fewer than two degrees; between one and two the logarithm is
// interpolated over 1 / freedom, which is at most 3 % too large.
double student(double freedom) {
  if (freedom < 2) {
    const double one = 2 / std::max(freedom, 1.) - 1;  // 1 at one degree, 0 at two
    return kTwoDegrees * std::pow(kOneDegree / kTwoDegrees, one);
  }
  const double z = kNormal95 * kNormal95, f = 1 / freedom;
  return kNormal95 * (1 + f * ((z + 1) / 4 + f * (((5 * z + 16) * z + 3) / 96 +
                                                  f * (((3 * z + 19) * z + 17) * z - 15) / 384)));
}

double fourth(double x) { return x * x * x * x; }

}  // namespace

void AreaSums::add(const AreaSums& o) {
  if (o.pixels == 0) return;
  fewest_before = pixels == 0 ? o.fewest_before : std::min(fewest_before, o.fewest_before);
  most_before = std::max(most_before, o.most_before);
  for (std::size_t c = 0; c < 3; ++c) {
    values[c] += o.values[c];
    noise[c] += o.noise[c];
    last[c] += o.last[c];
    powers[c] += o.powers[c];
    squares[c] += o.squares[c];
    fourths[c] += o.fourths[c];
  }
  relative += o.relative;
  spread += o.spread;
  spread_squares += o.spread_squares;
  samples += o.samples;
  pixels += o.pixels;
  count += o.count;
}

AreaSums area_sums(const HalfMeans& h, std::uint64_t spp, const EarlierMeans* earlier) {
  const auto width = static_cast<std::size_t>(h.width), height = static_cast<std::size_t>(h.height);
  AreaSums out{.samples = spp * h.pixels(), .pixels = h.pixels()};
  const std::size_t across = (width + kCorrelatedSide - 1) / kCorrelatedSide,
                    down = (height + kCorrelatedSide - 1) / kCorrelatedSide;
  out.count = across * down;
  std::vector<double> spreads(out.count);  // u of each square
  for (std::size_t c = 0; c < 3; ++c) {
    std::vector<double> values(out.count), noise(out.count), powers(out.count);
    for (std::size_t y = 0; y < height; ++y)
      for (std::size_t square = 0; square < across; ++square) {
        const std::size_t row = (c * height + y) * width,
                          end = std::min(width, (square + 1) * kCorrelatedSide);
        double value = 0, difference = 0, power = 0;
        for (std::size_t x = square * kCorrelatedSide; x < end; ++x) {
          value += h.a[row + x] + h.b[row + x];
          const double d = h.a[row + x] - h.b[row + x];
          difference += d;
          power += d * d;
        }
        values[y / kCorrelatedSide * across + square] += value / 2;
        noise[y / kCorrelatedSide * across + square] += difference / 2;
        powers[y / kCorrelatedSide * across + square] += power / 4;
      }
    for (std::size_t i = 0; i < out.count; ++i) {
      const auto pixels =
          static_cast<double>(std::min(kCorrelatedSide, width - i % across * kCorrelatedSide) *
                              std::min(kCorrelatedSide, height - i / across * kCorrelatedSide));
      const double mean = values[i] / pixels;
      out.values[c] += values[i];
      out.noise[c] += noise[i];
      out.powers[c] += powers[i];
      out.squares[c] += noise[i] * noise[i];
      out.fourths[c] += fourth(noise[i]);
      const double weight = 1 / (mean * mean + kRelMseDenominator);
      out.relative += noise[i] * noise[i] / pixels * weight;
      spreads[i] += powers[i] * weight;
    }
    if (!earlier) continue;
    double before = 0;
    for (std::size_t i = c * h.pixels(); i < (c + 1) * h.pixels(); ++i)
      before += earlier->halves.a[i] - earlier->halves.b[i];
    out.last[c] = out.noise[c] - before / 2 * static_cast<double>(earlier->spp) / static_cast<double>(spp);
  }
  for (const double u : spreads) {
    out.spread += u;
    out.spread_squares += u * u;
  }
  if (earlier) out.fewest_before = out.most_before = earlier->spp;
  return out;
}

AreaError area_error(const AreaSums& s, bool common) {
  AreaError out{};
  if (s.pixels == 0) return out;
  const auto pixels = static_cast<double>(s.pixels), count = static_cast<double>(s.count);
  const bool two_parts = s.fewest_before == s.most_before && s.fewest_before >= kSetSamples;
  // The variances of the two parts are in proportion to their samples (Satterthwaite 1946).
  const double before_share = static_cast<double>(s.fewest_before) * pixels / static_cast<double>(s.samples),
               last_share = 1 - before_share,
               degrees = two_parts ? 1 / (before_share * before_share + last_share * last_share) : 1;
  double correlation = 0;
  for (std::size_t c = 0; c < 3; ++c) {
    out.mean[c] = s.values[c] / pixels;
    const double before = s.noise[c] - s.last[c],
                 alike = two_parts ? s.last[c] * s.last[c] + before * before : s.noise[c] * s.noise[c];
    if (!(s.squares[c] > 0)) continue;
    const double freedom = 3 * s.squares[c] * s.squares[c] / s.fourths[c] - 2,
                 variance = std::max(s.squares[c], std::sqrt(s.powers[c] * s.squares[c]));
    out.half_width[c] =
        (common ? student(degrees) * std::sqrt(alike) : student(freedom) * std::sqrt(variance)) / pixels;
    if (count > 1)
      correlation = std::max(correlation, std::clamp((alike / s.squares[c] - 1) / (count - 1), 0.0, 1.0));
  }
  out.relmse = s.relative / (3 * pixels);
  if (!(s.relative > 0)) return out;
  const double effective = s.spread * s.spread / s.spread_squares;
  if (effective < kFewestSquares) return out;
  const double spread = std::sqrt(4 / effective + (common ? 4 * correlation * correlation : 0));
  const double relative = student(effective) * spread;
  out.relmse_lo = out.relmse * std::exp(-relative);
  out.relmse_hi = out.relmse * std::exp(relative);
  return out;
}

}  // namespace ls
