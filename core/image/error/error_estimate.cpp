#include "core/image/error/error_estimate.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>

#include "core/base/check.h"
#include "core/image/error/relative_weights.h"
#include "core/image/frame/meter_blocks.h"

namespace ls {

namespace {

constexpr int kReach = 2;  // radius of the 5 x 5 window
// The figures are not trusted if fewer than kFewPixels pixels carry the error: with 100 equal pixels of
// Gaussian noise, the estimated sum of squared errors differs from the realised one with a relative standard
// deviation of sqrt(4/3/100) = 12 %. In a small image 1 / kPartOfSmall of its pixels suffices, because object
// edges alone sometimes carry the error of a 32 x 32 image.
constexpr double kFewPixels = 100, kPartOfSmall = 48;
// The interval of RMSE, which is not weighed, is unknown if fewer than so many pixels carry the error: the
// light of the brightest ones may not have been found at all, and then the error is larger by far. Pixels of
// equal Gaussian noise count as a third of their number; to a sixteenth it falls where the noise of single
// pixels is several times as large as that of most.
constexpr double kFewUnweighed = 256, kPartUnweighed = 16;
// In images with many pixels the figures are not trusted if one pixel has a larger share of the error than
// this.
constexpr double kLargeShare = 0.1;
// In smooth parts of the image tr(V^2) is estimated in two ways, from fourth powers of D and from pairs of
// neighbours. The figures are not trusted if the first estimate is more than this factor times the second.
// The ratio is 1 for Gaussian noise, and up to 6 for low-discrepancy points on a smooth image
// (tests/coverage).
constexpr double kHeavy = 10;
// A pixel has few hits if one half of the samples has more than this many times the light of the other half.
constexpr double kFewHits = 19;
// A pixel is one-sided if one half of the samples has more than this many times the light of the other half.
// If such pixels have less than kSettledShare of the error, few pixels that carry it are no reason for doubt:
// they are not outliers, but pixels such as those at the edge of a lamp, whose light is found all the time.
constexpr double kOneSided = 4, kSettledShare = 0.25;
// Even then at least this many pixels must carry the error.
constexpr double kFewestPixels = 8;
// The interval is computed from the last round only if this round has at least this many samples per pixel
// and all earlier rounds together have, too. With fewer, such as 8 in each half, a single sample that finds
// rare light would dominate.
constexpr std::uint64_t kTellingSamples = 16;
// The interval of relMSE contains both sums of squared relative errors, which differ in their weights, and
// reaches beyond by this part of the distance between their logarithms.
constexpr double kBeyond = 0.5;

// Returns the expected amount by which skewed noise lowers the sum of squared relative errors, as a negative
// number. error_estimate.h derives it. The sum is accumulated per column, so that the compiler vectorises the
// loop.
double skew_of(const HalfMeans& now, std::uint64_t spp, const EarlierMeans& earlier,
               const RelativeWeights& w) {
  const double before = static_cast<double>(earlier.spp) / static_cast<double>(spp), last = 1 - before;
  const auto width = static_cast<std::size_t>(now.width);
  std::vector<double> columns(width);
  double* sums = columns.data();
  for (std::size_t row = 0; row < now.a.size(); row += width) {
    const double *a = &now.a[row], *b = &now.b[row], *a1 = &earlier.halves.a[row],
                 *b1 = &earlier.halves.b[row];
    const double *roots = &w.roots[row], *leans = &w.leans[row];
    for (std::size_t x = 0; x < width; ++x) {
      // The mean of a half is the sum of a part from the last round and a part from earlier rounds. For half
      // A these parts are `an` and `ao`, for half B `bn` and `bo`. Each part is the mean of its samples times
      // their share of all samples, which is `last` or `before`.
      const double ao = before * a1[x], bo = before * b1[x], an = a[x] - ao, bn = b[x] - bo;
      const double of_before = 0.25 * (ao - bo) * (ao - bo), of_last = 0.25 * (an - bn) * (an - bn);
      const double apart = 0.5 * ((an + bn) / last - (ao + bo) / before);
      const double most = 0.5 * roots[x] * roots[x], change = leans[x] * apart;
      const double up = last * change, down = -before * change;
      sums[x] += of_last * (up < -most  ? -most
                            : most < up ? most
                                        : up) +
                 of_before * (down < -most  ? -most
                              : most < down ? most
                                            : down);
    }
  }
  return std::accumulate(columns.begin(), columns.end(), 0.0);
}

// Returns the sum of squared relative errors in which no noise has a part in its own weight, or nullopt if
// the last round and the samples before it are not equally many. error_estimate.h derives it. `roots` are
// those of the weights of all samples.
std::optional<double> cross_weighted(const HalfMeans& now, std::uint64_t spp, const EarlierMeans& earlier,
                                     const std::vector<double>& roots) {
  if (2 * earlier.spp != spp) return std::nullopt;
  const std::size_t n = now.a.size();
  std::vector<double> a(n), b(n);
  for (std::size_t i = 0; i < n; ++i)
    a[i] = 2 * now.a[i] - earlier.halves.a[i], b[i] = 2 * now.b[i] - earlier.halves.b[i];
  const std::vector<double> before = relative_weights(earlier.halves).roots,
                            last = relative_weights({now.width, now.height, a, b}).roots;
  double sum = 0;
  for (std::size_t i = 0; i < n; ++i) {
    const double d_before = 0.5 * (earlier.halves.a[i] - earlier.halves.b[i]), d_last = 0.5 * (a[i] - b[i]);
    sum += before[i] * before[i] * d_last * d_last + last[i] * last[i] * d_before * d_before +
           2 * roots[i] * roots[i] * d_last * d_before;
  }
  return sum / 4;
}

// Returns the sum over pixels of tr(V^2), estimated from fourth powers and, for a trusted image, also from
// pairs of neighbours. error_estimate.h derives both and defines V.
double trace_of_moments(const NoiseSums& s, bool trusted) {
  const double r2 = s.pair_variance > 0 ? std::clamp(s.pair_covariance / s.pair_variance, 0.0, 1.0) : 1.0;
  const double channel = trusted ? s.edge_channel_fourth : s.channel_fourth,
               pixel = trusted ? s.edge_pixel_fourth : s.pixel_fourth;
  const double cross = std::max(0.0, pixel - channel);
  return channel / 3 + cross * r2 / (1 + 2 * r2) + (trusted ? s.flat_pairs : 0);
}

// Returns the standard deviation of the difference between the estimated and the realised sum of squares,
// divided by the estimated sum. error_estimate.h derives it.
double relative_spread(const NoiseSums& s, double pixels, bool trusted) {
  if (!(s.squares > 0)) return 0;
  if (!trusted) return 2 * std::sqrt(trace_of_moments(s, false)) / s.squares;
  const double of_moments =
      2 * std::pow(trace_of_moments(s, true) * trace_of_moments(s, false), 0.25) / s.squares;
  if (s.changes.square_products == 0) return of_moments;
  const double of_changes = 2 * std::sqrt(s.changes.products) / s.changes.squares;
  const double squares = pixels / (kCorrelatedSide * kCorrelatedSide),
               weight = squares / (squares + kHalfWeightSquares);
  const double excess = std::max(0.0, s.changes.square_products - s.changes.products);
  return std::hypot((of_moments + of_changes) / 2, 2 * std::sqrt(weight * excess) / s.changes.squares);
}

// Returns the sums from which the interval is computed. `a` and `b` are the changes of the means of half A
// and half B since the earlier rounds, three planes each, of a tile that is `width` pixels wide; `scale` is a
// factor on their squares.
ChangeSums change_sums(const std::vector<double>& a, const std::vector<double>& b, std::size_t width,
                       double scale) {
  const std::size_t n = a.size() / 3, across = (width + kCorrelatedSide - 1) / kCorrelatedSide;
  ChangeSums out;
  std::vector<double> squares(across);  // sums of dot over the pixels of each square of the current row
  for (std::size_t i = 0; i < n; ++i) {
    const double ar = a[i], ag = a[n + i], ab = a[2 * n + i], br = b[i], bg = b[n + i], bb = b[2 * n + i];
    const double dot = ar * br + ag * bg + ab * bb;
    out.squares += ar * ar + ag * ag + ab * ab + br * br + bg * bg + bb * bb;
    out.products += dot * dot;
    squares[i % width / kCorrelatedSide] += dot;
    if ((i + 1) % (kCorrelatedSide * width) != 0 && i + 1 != n) continue;
    for (double& sum : squares) {
      out.square_products += sum * sum;
      sum = 0;
    }
  }
  out.squares *= scale / 2;
  out.products *= scale * scale;
  out.square_products *= scale * scale;
  return out;
}

// The number of pixels that carry the error (ImageError::effective_pixels).
double effective_pixels(const NoiseSums& s) {
  return s.pixel_fourth > 0 ? s.squares * s.squares / s.pixel_fourth : 0;
}

// Returns true if the pixels with the largest noise have light in both halves: they are not outliers.
bool settled(const NoiseSums& s) { return s.one_sided < kSettledShare * s.squares; }

// Returns true if a single pixel has a large share of the error of a large image.
bool one_pixel_rules(const NoiseSums& s, double pixels) {
  return s.largest > kLargeShare * s.squares && pixels * kLargeShare > 4 * kFewPixels;
}

// Returns true if RMSE has an interval: pixels with light in both halves carry the error, and not few.
bool rmse_known(const NoiseSums& s, double pixels) {
  return settled(s) && effective_pixels(s) >= std::min(kFewUnweighed, pixels / kPartUnweighed) &&
         !one_pixel_rules(s, pixels);
}

// Returns true if few pixels carry the error.
bool carried_by_few(const NoiseSums& s, double pixels) {
  return effective_pixels(s) < std::min(kFewPixels, pixels / kPartOfSmall) || one_pixel_rules(s, pixels);
}

// Returns true if single pixels have far more noise than their neighbours, as outliers do. The noise of the
// smooth parts of the image counts if they have more than the share kPart of the fourth powers.
bool has_outliers(const NoiseSums& s) {
  constexpr double kPart = .25;
  const double flat = s.pixel_fourth - s.edge_pixel_fourth;
  return flat > kPart * s.pixel_fourth && flat / 3 > kHeavy * s.flat_pairs;
}

void judge(ImageError& out, const NoiseSums& sums, double pixels) {
  if (!out.lit) {
    out.verdict =
        "don't trust yet: no sample has found any light: either the camera sees none, or it is too hard to "
        "find for so "
        "few samples";
  } else if (out.effective_pixels == 0) {
    out.trusted = out.spp >= 64;
    if (!out.trusted)
      out.verdict = "the two halves of the samples do not differ yet: too few samples to tell the error";
  } else if (settled(sums) && out.effective_pixels >= std::min(kFewestPixels, pixels / kPartOfSmall)) {
    out.trusted = true;
  } else if (carried_by_few(sums, pixels)) {
    out.verdict = fmt::format(
        "don't trust yet: few pixels carry the error (like {:.0f} of {:.0f}; the worst one {:.0f} %); bright "
        "outliers may still be missing, so the true error may be larger",
        out.effective_pixels, pixels, 100 * out.top_share);
  } else if (has_outliers(sums)) {
    out.verdict =
        "don't trust yet: single pixels differ far more than those around them; more bright outliers may "
        "still be "
        "missing, so the true error may be larger";
  } else {
    out.trusted = true;
  }
}

}  // namespace

namespace {

double light(std::span<const double> half, std::size_t pixel, std::size_t pixels) {
  return half[pixel] + half[pixels + pixel] + half[2 * pixels + pixel];
}

}  // namespace

bool has_few_hits(const HalfMeans& h, int x, int y) {
  const std::size_t pixels = h.pixels();
  const auto at = [&](int i, int j) {
    return static_cast<std::size_t>(j) * static_cast<std::size_t>(h.width) + static_cast<std::size_t>(i);
  };
  const double a = light(h.a, at(x, y), pixels), b = light(h.b, at(x, y), pixels);
  if (a != 0 || b != 0) return std::max(a, b) > kFewHits * std::min(a, b);
  int lit = 0, all = 0;
  for (int j = std::max(0, y - kReach); j <= std::min(h.height - 1, y + kReach); ++j)
    for (int i = std::max(0, x - kReach); i <= std::min(h.width - 1, x + kReach); ++i) {
      ++all;
      lit += light(h.a, at(i, j), pixels) != 0 || light(h.b, at(i, j), pixels) != 0;
    }
  return 2 * lit > all - 1;
}

void NoiseSums::add(const NoiseSums& o) {
  squares += o.squares;
  channel_fourth += o.channel_fourth;
  pixel_fourth += o.pixel_fourth;
  pair_covariance += o.pair_covariance;
  pair_variance += o.pair_variance;
  edge_channel_fourth += o.edge_channel_fourth;
  edge_pixel_fourth += o.edge_pixel_fourth;
  flat_pairs += o.flat_pairs;
  largest = std::max(largest, o.largest);
  one_sided += o.one_sided;
  changes.squares += o.changes.squares;
  changes.products += o.changes.products;
  changes.square_products += o.changes.square_products;
}

void TileError::add(const TileError& o) {
  pixels += o.pixels;
  samples += o.samples;
  few_hits += o.few_hits;
  lit += o.lit;
  skew += o.skew;
  other_weights += o.other_weights;
  unsure_weights += o.unsure_weights;
  areas.add(o.areas);
  plain.add(o.plain);
  relative.add(o.relative);
}

void TileError::subtract_skew(double part) {
  relative.squares -= part;
  skew += part;
}

namespace {

// Counts the pixels with light and those with few hits. Nearly all pixels have light in both halves and are
// counted by a vectorised loop; only black pixels need their neighbours.
void count_hits(const HalfMeans& h, TileError& out) {
  const std::size_t n = h.pixels();
  const double *a = h.a.data(), *b = h.b.data();
  std::uint64_t lit = 0, few_hits = 0;
  for (std::size_t i = 0; i < n; ++i) {
    const double of_a = a[i] + a[n + i] + a[2 * n + i], of_b = b[i] + b[n + i] + b[2 * n + i];
    lit += (of_a != 0) | (of_b != 0);
    few_hits += (of_a > kFewHits * of_b) | (of_b > kFewHits * of_a);
  }
  out.lit = lit;
  out.few_hits = few_hits;
  if (lit == n || lit == 0) return;
  for (std::size_t i = 0; i < n; ++i)
    if (light(h.a, i, n) == 0 && light(h.b, i, n) == 0)
      out.few_hits += has_few_hits(h, static_cast<int>(i) % h.width, static_cast<int>(i) / h.width);
}

}  // namespace

namespace {

// Sets the sums of changes from the last round, if this round and the earlier rounds together have enough
// samples.
void send_changes(const HalfMeans& h, std::uint64_t spp, const EarlierMeans& earlier,
                  const std::vector<double>& roots, TileError& out) {
  if (std::min(earlier.spp, spp - earlier.spp) < kTellingSamples) return;
  const std::size_t n = h.a.size(), width = static_cast<std::size_t>(h.width);
  const double scale = static_cast<double>(earlier.spp) / static_cast<double>(2 * (spp - earlier.spp));
  std::vector<double> a(n), b(n);
  for (std::size_t i = 0; i < n; ++i)
    a[i] = h.a[i] - earlier.halves.a[i], b[i] = h.b[i] - earlier.halves.b[i];
  const ChangeSums plain = change_sums(a, b, width, scale);
  for (std::size_t i = 0; i < n; ++i) a[i] *= roots[i], b[i] *= roots[i];
  const ChangeSums relative = change_sums(a, b, width, scale);
  if (plain.squares > 0) out.plain.changes = plain;
  if (relative.squares > 0) out.relative.changes = relative;
}

}  // namespace

namespace {

// Returns for each pixel 1 if it is one-sided (kOneSided), otherwise 0.
std::vector<double> one_sided_pixels(const HalfMeans& h) {
  const std::size_t n = h.pixels();
  std::vector<double> out(n);
  const double *a = h.a.data(), *b = h.b.data();
  for (std::size_t i = 0; i < n; ++i) {
    const double of_a = a[i] + a[n + i] + a[2 * n + i], of_b = b[i] + b[n + i] + b[2 * n + i];
    out[i] = (of_a > kOneSided * of_b) | (of_b > kOneSided * of_a) ? 1. : 0.;
  }
  return out;
}

// Returns the sum of the squares of `values`, which has three planes, over the pixels for which `sides` is 1.
double one_sided_squares(const std::vector<double>& values, const std::vector<double>& sides) {
  const std::size_t n = sides.size();
  double sum = 0;
  for (std::size_t i = 0; i < n; ++i) {
    const double r = values[i], g = values[n + i], b = values[2 * n + i];
    sum += sides[i] * (r * r + g * g + b * b);
  }
  return sum;
}

}  // namespace

TileError estimate_error(const HalfMeans& h, std::uint64_t spp, const EarlierMeans* earlier) {
  const std::size_t n = h.pixels();
  CHECK(h.a.size() == 3 * n && h.b.size() == 3 * n, "{} and {} values for {} x {} pixels", h.a.size(),
        h.b.size(), h.width, h.height);
  TileError out{.pixels = n, .samples = spp * n};
  count_hits(h, out);
  std::vector<double> d(3 * n);
  for (std::size_t i = 0; i < 3 * n; ++i) d[i] = 0.5 * (h.a[i] - h.b[i]);
  const RelativeWeights w = relative_weights(h);
  const std::vector<double> sides = one_sided_pixels(h);
  out.plain = noise_sums(d, w.edges, h.width, h.height);
  out.plain.one_sided = one_sided_squares(d, sides);
  for (std::size_t i = 0; i < 3 * n; ++i) d[i] *= w.roots[i];
  out.relative = noise_sums(d, w.edges, h.width, h.height);
  out.relative.one_sided = one_sided_squares(d, sides);
  for (const double delta : w.unsure) out.unsure_weights += delta * delta;
  for (NoiseSums* sums : {&out.plain, &out.relative})
    sums->changes = {sums->squares, trace_of_moments(*sums, true), 0};
  out.areas = area_sums(h, spp, earlier);
  if (!earlier) return out;
  CHECK(earlier->halves.a.size() == 3 * n && earlier->halves.b.size() == 3 * n && earlier->spp >= 2 &&
            earlier->spp < spp,
        "{} and {} values of {} samples before {} of {}", earlier->halves.a.size(), earlier->halves.b.size(),
        earlier->spp, 3 * n, spp);
  // The correction is limited to half of the estimated error. It is computed from the errors of the last
  // round and of the earlier samples. With low-discrepancy points the error of all samples together is
  // smaller than these two suggest, so the correction might be too large.
  const double all = out.relative.squares;
  out.subtract_skew(std::clamp(skew_of(h, spp, *earlier, w), -all / 2, all / 2));
  if (const auto other = cross_weighted(h, spp, *earlier, w.roots))
    out.other_weights = *other - out.relative.squares;
  send_changes(h, spp, *earlier, w.roots, out);
  return out;
}

namespace {

// Returns sqrt(w / n) of each pixel and channel, where w is the weight of the mean of the pixel's block and n
// the number of its pixels: times D, it is the relative error of that mean.
std::vector<double> meter_roots(const HalfMeans& h) {
  const auto side = static_cast<std::size_t>(kMeterSide), width = static_cast<std::size_t>(h.width),
             height = static_cast<std::size_t>(h.height);
  std::vector<double> roots(3 * h.pixels());
  for (std::size_t c = 0; c < 3; ++c)
    for (std::size_t top = 0; top < height; top += side)
      for (std::size_t left = 0; left < width; left += side) {
        const auto each = [&](const auto& f) {
          for (std::size_t y = top; y < std::min(top + side, height); ++y)
            for (std::size_t x = left; x < std::min(left + side, width); ++x)
              f(c * h.pixels() + y * width + x);
        };
        double n = 0, sum = 0, squares = 0;
        each([&](std::size_t i) {
          const double d = 0.5 * (h.a[i] - h.b[i]);
          n += 1, sum += 0.5 * (h.a[i] + h.b[i]), squares += d * d;
        });
        const double root = std::sqrt(relative_weight(sum / n, squares / (n * n)) / n);
        each([&](std::size_t i) { roots[i] = root; });
      }
  return roots;
}

}  // namespace

TileError estimate_meter_error(const HalfMeans& h, std::uint64_t spp, const EarlierMeans* earlier) {
  const std::size_t n = h.pixels();
  TileError out{.pixels = n, .samples = spp * n};
  count_hits(h, out);
  const std::vector<double> roots = meter_roots(h), edges(n), sides = one_sided_pixels(h);
  std::vector<double> d(3 * n);
  const auto sums_of = [&](const auto& factor) {
    for (std::size_t i = 0; i < 3 * n; ++i) d[i] = 0.5 * (h.a[i] - h.b[i]) * factor(i);
    NoiseSums sums = noise_sums(d, edges, h.width, h.height);
    sums.one_sided = one_sided_squares(d, sides);
    sums.changes = {sums.squares, trace_of_moments(sums, true), 0};
    return sums;
  };
  out.plain = sums_of([](std::size_t) { return 1. / kMeterSide; });
  out.relative = sums_of([&](std::size_t i) { return roots[i]; });
  out.areas = area_sums(h, spp, earlier);
  return out;
}

namespace {

// Returns half the width of the 95 % interval of the logarithm of a sum of squares. On a log scale the lower
// end stays above zero. The spread is itself an estimate, so the factor is not the normal quantile but
// Student's t, to first order in 1 / degrees of freedom (Abramowitz and Stegun 26.7.5).
//
// Degrees of freedom: let x be the sum of D^2 over the channels of a pixel, and e = (sum x)^2 / (sum of x^2),
// which is n / 3 for n equal grey pixels with Gaussian noise.
// - If the spread is from fourth powers, the sum of these has a relative variance of 96 / (9 n), about that
//   of a chi square with e / 2 degrees of freedom.
// - If it is from the last round, 4 products / squares^2 has a relative variance of (8 + 4 - 8) / n (from the
//   products, the squares and their covariance), hence 3 e / 2 degrees. Uneven noise has fewer, but at least
//   e / 2 in the scenes of tests/coverage.
// So e / 2 is used for both.
double half_width(const NoiseSums& s, double pixels, bool trusted) {
  if (!(s.pixel_fourth > 0)) return 0;
  const double freedom = s.squares * s.squares / s.pixel_fourth / 2;
  return kNormal95 * (1 + (kNormal95 * kNormal95 + 1) / (4 * freedom)) * relative_spread(s, pixels, trusted);
}

}  // namespace

ImageError image_error(const TileError& sums) {
  ImageError out;
  if (sums.pixels == 0) return out;
  const auto pixels = static_cast<double>(sums.pixels);
  out.rmse = std::sqrt(sums.plain.squares / (3 * pixels));
  out.relmse = sums.relative.squares / (3 * pixels);
  out.spp = static_cast<double>(sums.samples) / pixels;
  out.few_hits = sums.few_hits;
  out.effective_pixels = effective_pixels(sums.relative);
  if (out.effective_pixels > 0) out.top_share = sums.relative.largest / sums.relative.squares;
  out.lit = sums.lit > 0;
  judge(out, sums.relative, pixels);
  out.settled = settled(sums.plain);
  if (!out.trusted || rmse_known(sums.plain, pixels)) {
    const double plain = half_width(sums.plain, pixels, out.trusted);
    out.rmse_lo = out.rmse * std::exp(-plain / 2);
    out.rmse_hi = out.rmse * std::exp(plain / 2);
  }
  const double relative = half_width(sums.relative, pixels, out.trusted);
  const double other = std::max(0.0, out.relmse + sums.other_weights / (3 * pixels));
  const double apart = other > 0 && out.relmse > 0 ? std::log(other / out.relmse) : 0;
  const double unsure = out.relmse > 0 ? std::sqrt(sums.unsure_weights) / sums.relative.squares : 0;
  const double up = std::max(apart, -kBeyond * apart), down = std::max({-apart, kBeyond * apart, unsure});
  out.relmse_lo = out.relmse * std::exp(-relative - down);
  out.relmse_hi = out.relmse * std::exp(relative + up);
  return out;
}

bool Checkpoints::ready(const Tile& tile) const {
  return tile.reached > complete() || (tile.stopped && tile.reached > 0);
}

void Checkpoints::change(TileIndex index, const std::function<void(Tile&)>& edit) {
  CHECK(index < tiles_.size(), "tile {} of {}", index, tiles_.size());
  Tile& tile = tiles_[index];
  const bool before = ready(tile);
  edit(tile);
  const bool after = ready(tile);
  if (before && !after) ++waiting_;
  if (!before && after) --waiting_;
  settle();
}

void Checkpoints::folded(TileIndex index, RoundIndex round, const TileError& error) {
  change(index, [&](Tile& tile) {
    if (round >= complete()) {
      // Replaces the figures of the tile from this round on. If the tile had stopped and its rounds before
      // this one are missing, each missing round gets the figures that the tile had when it stopped.
      tile.pending.resize(round - complete(), tile.last);
      tile.pending.push_back(error);
    } else {
      tile.pending.clear();
    }
    tile.last = error;
    tile.reached = round + 1;
    tile.stopped = false;
  });
}

void Checkpoints::stopped(TileIndex index) {
  change(index, [](Tile& tile) { tile.stopped = true; });
}

void Checkpoints::settle() {
  while (waiting_ == 0) {
    TileError sum;
    bool moved = false;
    for (const Tile& tile : tiles_) {
      sum.add(tile.pending.empty() ? tile.last : tile.pending.front());
      moved |= !tile.pending.empty();
    }
    if (!moved) return;  // if every tile has stopped, there is no further checkpoint
    done_.push_back(sum);
    for (Tile& tile : tiles_) {
      if (!tile.pending.empty()) tile.pending.erase(tile.pending.begin());
      if (!ready(tile)) ++waiting_;
    }
  }
}

}  // namespace ls
