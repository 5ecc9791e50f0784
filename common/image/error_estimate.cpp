#include "common/image/error_estimate.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/base/check.h"

namespace ls {
namespace {

constexpr double kDark = 0.01;             // of relMSE's denominator
constexpr int kReach = 2;                  // of the 5 x 5 window
constexpr double k95 = 1.959963984540054;  // two-sided 95 % point of the normal distribution
// Fewer pixels than this carry the error: their own scatter (sqrt(4/3/100) = 12 % of the sum) says more than
// the sum does. Small images are asked for less: in one of 32 x 32, edges of things alone carry it at times.
constexpr double kFewPixels = 100, kPartOfSmall = 48;
constexpr double kLargeShare = 0.1;  // of one pixel, where there are many
// Where the picture is smooth, fourth powers are this much above what pairs of neighbours say of the
// variance: a Gaussian has 1, the low-discrepancy points of a smooth image up to 6 (tests/coverage).
constexpr double kHeavy = 10;

// Sums over 5 x 5 windows, clipped to the tile. Rows first, then columns, both along rows of memory.
std::vector<double> window_sums(const std::vector<double>& values, std::size_t width, std::size_t height) {
  constexpr std::size_t kPad = kReach;
  std::vector<double> padded(width + 2 * kPad), rows(width * (height + 2 * kPad)), sums(width * height);
  for (std::size_t y = 0; y < height; ++y) {
    std::copy_n(&values[y * width], width, &padded[kPad]);
    double* out = &rows[(y + kPad) * width];
    for (std::size_t x = 0; x < width; ++x)
      out[x] = padded[x] + padded[x + 1] + padded[x + 2] + padded[x + 3] + padded[x + 4];
  }
  for (std::size_t i = 0; i < width * height; ++i)
    sums[i] = rows[i] + rows[i + width] + rows[i + 2 * width] + rows[i + 3 * width] + rows[i + 4 * width];
  return sums;
}

int span_of(int i, int count) { return std::min(count - 1, i + kReach) - std::max(0, i - kReach) + 1; }

// What is known of one channel of a pixel: its own values, and sums over its window without it.
struct Surroundings {
  double own, own_noise;       // S, D^2
  double others;               // how many
  double sum, squares, noise;  // of S, S^2 and D^2
};

// 1 / (m^2 + c), the share g of the pixel's own value in m, and how the weight changes with that value.
struct Weight {
  double weight, gain, lean;
};

double lean_of(double m, double g) {
  const double f = 1 / (m * m + kDark);
  return -2 * m * f * f * g;
}

Weight weight_of(const Surroundings& s) {
  if (s.others == 0) return {relative_weight(s.own, 0), 1, lean_of(s.own, 1)};
  constexpr double kSignificant = 9;
  const double mean = s.sum / s.others, u = s.noise / s.others, apart = (s.own - mean) * (s.own - mean);
  double structure = std::max(0.0, s.squares / s.others - mean * mean - u * (1 - 1 / s.others));
  if (apart > kSignificant * std::max(u, s.own_noise)) structure = std::max(structure, apart);
  const double v = s.own_noise > structure + u ? s.own_noise : u;
  const double g = structure > 0 ? structure / (structure + v) : 0;
  const double m = mean + g * (s.own - mean);
  return {relative_weight(m, u * (g * g + (1 - g) * (1 - g) / s.others)), g, lean_of(m, g)};
}

// Of each pixel: the square root of the weight in each channel and how it leans, planar, and the square of
// the mean of g over channels.
struct Weights {
  std::vector<double> roots, leans, edges;
};

void add_channel(const HalfMeans& h, std::size_t plane, Weights& to) {
  const auto width = static_cast<std::size_t>(h.width), height = static_cast<std::size_t>(h.height);
  const double *a = &h.a[plane], *b = &h.b[plane];
  std::vector<double> own(width * height), square(width * height), noise(width * height);
  for (std::size_t i = 0; i < own.size(); ++i) {
    own[i] = 0.5 * (a[i] + b[i]);
    square[i] = own[i] * own[i];
    noise[i] = 0.25 * (a[i] - b[i]) * (a[i] - b[i]);
  }
  const auto sum = window_sums(own, width, height), squares = window_sums(square, width, height),
             noises = window_sums(noise, width, height);
  std::size_t i = 0;
  for (int y = 0; y < h.height; ++y)
    for (int x = 0; x < h.width; ++x, ++i) {
      const int others = span_of(x, h.width) * span_of(y, h.height) - 1;
      const Weight w = weight_of({own[i], noise[i], static_cast<double>(others), sum[i] - own[i],
                                  squares[i] - square[i], std::max(0.0, noises[i] - noise[i])});
      to.roots[plane + i] = std::sqrt(w.weight);
      to.leans[plane + i] = w.lean;
      to.edges[i] += w.gain / 3;
    }
}

Weights weights(const HalfMeans& h) {
  const auto n = static_cast<std::size_t>(h.width) * static_cast<std::size_t>(h.height);
  Weights out{std::vector<double>(3 * n), std::vector<double>(3 * n), std::vector<double>(n)};
  for (std::size_t c = 0; c < 3; ++c) add_channel(h, c * n, out);
  for (double& g : out.edges) g *= g;
  return out;
}

// What skewed noise takes off the sum of relative squares in the mean (the header has the derivation).
double skew_of(const HalfMeans& now, std::uint64_t spp, const EarlierMeans& earlier, const Weights& w) {
  const double before = static_cast<double>(earlier.spp) / static_cast<double>(spp), last = 1 - before;
  double sum = 0;
  for (std::size_t i = 0; i < now.a.size(); ++i) {
    // Each half's part of the mean: a = last * a_n + before * a_o.
    const double ao = before * earlier.halves.a[i], bo = before * earlier.halves.b[i];
    const double an = now.a[i] - ao, bn = now.b[i] - bo;
    const double of_before = 0.25 * (ao - bo) * (ao - bo), of_last = 0.25 * (an - bn) * (an - bn);
    const double apart = 0.5 * ((an + bn) / last - (ao + bo) / before);
    const double most = 0.5 * w.roots[i] * w.roots[i], change = w.leans[i] * apart;
    sum += of_last * std::clamp(last * change, -most, most) +
           of_before * std::clamp(-before * change, -most, most);
  }
  return sum;
}

// Three planes of one tile, and what a pixel and its neighbour have in common.
struct Differences {
  std::span<const double> r, g, b;
  double dot(std::size_t p, std::size_t q) const { return r[p] * r[q] + g[p] * g[q] + b[p] * b[q]; }
};

// Of (D(p) . D(q))^2 over the neighbours beside, above and below.
double mean_of_pairs(const Differences& d, int x, int y, int width, int height) {
  const auto w = static_cast<std::size_t>(width),
             p = static_cast<std::size_t>(y) * w + static_cast<std::size_t>(x);
  double sum = 0;
  int count = 0;
  const auto add = [&](bool there, std::size_t q) {
    if (!there) return;
    const double dot = d.dot(p, q);
    sum += dot * dot;
    ++count;
  };
  add(x > 0, p - 1);
  add(x + 1 < width, p + 1);
  add(y > 0, p - w);
  add(y + 1 < height, p + w);
  return count > 0 ? sum / count : 0;
}

// `values`: three planes of `width` x `height`; `edges`: one.
NoiseSums noise_sums(const std::vector<double>& values, const std::vector<double>& edges, int width,
                     int height) {
  NoiseSums out;
  const auto n = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  const std::span<const double> all(values);
  const Differences d{all.first(n), all.subspan(n, n), all.last(n)};
  const auto &r = d.r, &g = d.g, &b = d.b;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const std::size_t p =
          static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x);
      const double rr = r[p] * r[p], gg = g[p] * g[p], bb = b[p] * b[p], sum = rr + gg + bb;
      const double fourth = rr * rr + gg * gg + bb * bb;
      out.squares += sum;
      out.channel_fourth += fourth;
      out.pixel_fourth += sum * sum;
      out.edge_channel_fourth += edges[p] * fourth;
      out.edge_pixel_fourth += edges[p] * sum * sum;
      out.flat_pairs += (1 - edges[p]) * mean_of_pairs(d, x, y, width, height);
      out.largest = std::max(out.largest, sum);
      if (x == 0) continue;
      const std::size_t q = p - 1;
      const double r2 = r[q] * r[q], g2 = g[q] * g[q], b2 = b[q] * b[q];
      out.pair_covariance +=
          r[p] * g[p] * r[q] * g[q] + r[p] * b[p] * r[q] * b[q] + g[p] * b[p] * g[q] * b[q];
      out.pair_variance += 0.5 * (rr * g2 + gg * r2 + rr * b2 + bb * r2 + gg * b2 + bb * g2);
    }
  }
  return out;
}

// Standard deviation of (estimated - realised) sum of squares over the estimated sum; see the header for the
// derivation.
double relative_spread(const NoiseSums& s, bool trusted) {
  if (!(s.squares > 0)) return 0;
  const double r2 = s.pair_variance > 0 ? std::clamp(s.pair_covariance / s.pair_variance, 0.0, 1.0) : 1.0;
  const double channel = trusted ? s.edge_channel_fourth : s.channel_fourth,
               pixel = trusted ? s.edge_pixel_fourth : s.pixel_fourth;
  const double cross = std::max(0.0, pixel - channel);
  const double trace = channel / 3 + cross * r2 / (1 + 2 * r2) + (trusted ? s.flat_pairs : 0);
  return std::sqrt(4 * trace) / s.squares;
}

// Fourth powers over pairs of neighbours where the picture is smooth; 0 where edges rule.
double heaviness(const NoiseSums& s) {
  constexpr double kPart = .25;
  const double flat = s.pixel_fourth - s.edge_pixel_fourth;
  if (!(flat > kPart * s.pixel_fourth)) return 0;
  return s.flat_pairs > 0 ? flat / 3 / s.flat_pairs : std::numeric_limits<double>::infinity();
}

void judge(ImageError& out, const NoiseSums& sums, double pixels, bool lit) {
  const double few = std::min(kFewPixels, pixels / kPartOfSmall);
  if (!lit) {
    out.verdict =
        "don't trust yet: no sample has found any light: either the camera sees none, or it is too hard to find for so "
        "few samples";
  } else if (out.effective_pixels == 0) {
    out.trusted = out.spp >= 64;
    if (!out.trusted)
      out.verdict = "the two halves of the samples do not differ yet: too few samples to tell the error";
  } else if (out.effective_pixels < few ||
             (out.top_share > kLargeShare && pixels * kLargeShare > 4 * kFewPixels)) {
    out.verdict = fmt::format(
        "don't trust yet: few pixels carry the error (like {:.0f} of {:.0f}; the worst one {:.0f} %); bright "
        "outliers may still be missing, so the true error may be larger",
        out.effective_pixels, pixels, 100 * out.top_share);
  } else if (heaviness(sums) > kHeavy) {
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

double relative_weight(double m, double s2) {
  const double q = m * m + kDark, f = 1 / q;
  const double unbiased =
      f - s2 * (3 * m * m - kDark) * f * f * f;  // the second derivative is (6 m^2 - 2 c) / q^3
  return std::clamp(unbiased, f / 2, 2 * f);
}

bool has_few_hits(const HalfMeans& h, int x, int y) {
  constexpr double kOneSided = 19;
  const auto pixels = static_cast<std::size_t>(h.width) * static_cast<std::size_t>(h.height);
  const auto at = [&](int i, int j) {
    return static_cast<std::size_t>(j) * static_cast<std::size_t>(h.width) + static_cast<std::size_t>(i);
  };
  const double a = light(h.a, at(x, y), pixels), b = light(h.b, at(x, y), pixels);
  if (a != 0 || b != 0) return std::max(a, b) > kOneSided * std::min(a, b);
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
}

void TileError::add(const TileError& o) {
  pixels += o.pixels;
  samples += o.samples;
  few_hits += o.few_hits;
  lit += o.lit;
  skew += o.skew;
  plain.add(o.plain);
  relative.add(o.relative);
}

void TileError::subtract_skew(double part) {
  relative.squares -= part;
  skew += part;
}

TileError estimate_error(const HalfMeans& h, std::uint64_t spp, const EarlierMeans* earlier) {
  const auto n = static_cast<std::size_t>(h.width) * static_cast<std::size_t>(h.height);
  CHECK(h.a.size() == 3 * n && h.b.size() == 3 * n, "{} and {} values for {} x {} pixels", h.a.size(),
        h.b.size(), h.width, h.height);
  TileError out{.pixels = n, .samples = spp * n};
  for (int y = 0; y < h.height; ++y)
    for (int x = 0; x < h.width; ++x) out.few_hits += has_few_hits(h, x, y);
  for (std::size_t i = 0; i < n; ++i) out.lit += light(h.a, i, n) != 0 || light(h.b, i, n) != 0;
  std::vector<double> d(3 * n);
  for (std::size_t i = 0; i < 3 * n; ++i) d[i] = 0.5 * (h.a[i] - h.b[i]);
  const Weights w = weights(h);
  out.plain = noise_sums(d, w.edges, h.width, h.height);
  for (std::size_t i = 0; i < 3 * n; ++i) d[i] *= w.roots[i];
  out.relative = noise_sums(d, w.edges, h.width, h.height);
  if (!earlier) return out;
  CHECK(earlier->halves.a.size() == 3 * n && earlier->halves.b.size() == 3 * n && earlier->spp >= 2 &&
            earlier->spp < spp,
        "{} and {} values of {} samples before {} of {}", earlier->halves.a.size(), earlier->halves.b.size(),
        earlier->spp, 3 * n, spp);
  // Points of low discrepancy make the whole better than its parts: a correction made of those is not to
  // rule.
  const double all = out.relative.squares;
  out.subtract_skew(std::clamp(skew_of(h, spp, *earlier, w), -all / 2, all / 2));
  return out;
}

namespace {

// Of the 95 % interval of the logarithm of a sum of squares; a log scale, so that the lower end stays above
// zero. The spread is an estimate, too, from fourth powers: of n even Gaussian pixels these have a relative
// variance of 96 / (9 n), and (sum x)^2 / sum x^2 = n / 3 = e, so theirs is that of a chi square with e / 2
// degrees of freedom. Student's t of these, to first order (Abramowitz and Stegun 26.7.5).
double half_width(const NoiseSums& s, bool trusted) {
  if (!(s.pixel_fourth > 0)) return 0;
  const double freedom = s.squares * s.squares / s.pixel_fourth / 2;
  return k95 * (1 + (k95 * k95 + 1) / (4 * freedom)) * relative_spread(s, trusted);
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
  if (sums.relative.pixel_fourth > 0) {
    out.effective_pixels = sums.relative.squares * sums.relative.squares / sums.relative.pixel_fourth;
    out.top_share = sums.relative.largest / sums.relative.squares;
  }
  judge(out, sums.relative, pixels, sums.lit > 0);
  const double plain = half_width(sums.plain, out.trusted), relative = half_width(sums.relative, out.trusted);
  out.rmse_lo = out.rmse * std::exp(-plain / 2);
  out.rmse_hi = out.rmse * std::exp(plain / 2);
  out.relmse_lo = out.relmse * std::exp(-relative);
  out.relmse_hi = out.relmse * std::exp(relative);
  return out;
}

}  // namespace ls
