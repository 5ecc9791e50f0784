// Estimates the error of an image from the image itself.
//
// A pixel's two half means A and B are independent and have the same expectation. Let a and b be their
// errors. The image (A+B)/2 has the error e = (a+b)/2, and D = (A-B)/2 = (a-b)/2 has the same variance v as
// e. So d = D^2 is an unbiased estimate of E[e^2]. The mean of d over pixels and channels estimates the mean
// squared error. The mean of w d estimates the relative one, with w = 1/(m^2 + 0.01) and m the pixel's true
// value.
//
// The estimate of m must not contain the noise that is being measured. If m were the pixel's value S =
// (A+B)/2, a firefly would enlarge its own denominator and hide most of its error. If m were W, the mean of
// the neighbours, it would be wrong at the edges of objects (docs/design/error.md has figures for both). So,
// per channel,
//   m = W + g (S - W),   g = T / (T + v),
// which is local Wiener filtering (Lee 1980) with
//   W   the mean of the 5 x 5 window without the pixel, clipped to the tile;
//   u   the window's mean of D^2;
//   T   the image's structure: the window's variance of S minus its noise u; or (S - W)^2 where that
//       exceeds 9 u and 9 D^2 (three standard deviations), as for a small bright object;
//   v   the noise: D^2 of the pixel where that exceeds T + u, otherwise u. The former is for fireflies: a
//       firefly is in one half only, so its D^2 equals (S - W)^2 and does not count as structure.
// In a flat or dark area g is near 0, and m does not depend on the pixel. Where the image's structure exceeds
// its noise, g is near 1. A tile of one pixel uses S. The noise that remains in m has the variance
//   s^2 = g^2 u + (1 - g)^2 u / k,   k: the number of pixels from which W is computed.
// Let f(m) = 1/(m^2 + c), c = 0.01, be the weight w. This noise would bias it by f" s^2 / 2, which is
// subtracted; the result is limited to [f/2, 2 f]. The remaining bias is of second order in s^2: for m = 0 it
// is 3 s^4 / c^2 relative to f.
//
// Skew: where g is near 1, the pixel's value enters its own weight, and the noise of rendered pixels is
// skewed: a bright sample raises both D^2 and S. So the sum of f D^2 is too low: to first order in the noise
// its error is f'(m) g cov(D^2, S), which is negative. Relative to the sum, this error falls like 1/N (2 % at
// 64 samples, docs/design/error.md). It is estimated from the samples of the last round, which are
// independent of earlier ones. Of N samples, n are in the last round and o before it. Let D_n and S_n be D
// and S of the last round alone, and D_o and S_o those of the earlier samples. With K the third cumulant of a
// sample (the pixel's true value cancels in the differences),
//   E[D_n^2 (S_n - S_o)] = K / n^2,   E[D_o^2 (S_o - S_n)] = K / o^2,   cov(D^2, S) = K / N^2.
// So cov(D^2, S) is the expectation of
//   t = ((n D_n / N)^2 (n / N) - (o D_o / N)^2 (o / N)) (S_n - S_o),
// and f'(m) g t is subtracted. (To first order in the noise, this is as if D_n^2 had the weight f of the
// earlier samples, and D_o^2 that of the last round.) The correction is limited to half of each pixel's
// weight. The first round has no earlier one and is not corrected.
//
// Weights: they are known from the image alone, and with few samples this is the largest source of doubt. So
// where both parts have equally many samples (the second to seventh round), the sum is computed a second
// time, with weights that do not know the noise that they weigh:
//   (n/N)^2 w_o D_n^2 + (o/N)^2 w_n D_o^2 + 2 (n o / N^2) w D_n D_o,
// with w_n and w_o the weights from one part alone. Such weights are noisier, so the two sums err in
// different ways, and how far they are apart tells how little the weights are known. On a logarithmic scale
// the interval reaches from the lower end that belongs to the smaller of the two sums to the upper end that
// belongs to the larger, and beyond the first sum by half of their distance on the other side, since both may
// be on the same side of the right value. (Half: chosen with images of few samples of tests/coverage.)
//
// Outliers: where v is D^2 of the pixel, the pixel is taken to be like its neighbours, and one half to hold
// an outlier. But the pixel may also be bright, and the other half have missed its light, as at the edge of a
// glint that one sample in 20 finds: then its weight is f(S), which is far smaller. Two halves cannot tell
// which of the two is true. Let
//   delta = sum over channels of max(0, w - f(S)) D^2
// be what such a pixel adds to the sum in the first case and not in the second. If p is the probability of
// the second case, the pixel's part of the sum has the variance p (1 - p) delta^2 <= delta^2 / 4. Pixels are
// of either kind independently, so 1.96 standard deviations are at most
//   sqrt(sum over pixels of delta^2).
// The lower end of the interval reaches lower by this, relative to the sum, or as far as the other sum of
// weights requires, whichever is more. No pixel is missing at the upper end: w > f(S).
//
// Interval of the realised error: d - e^2 = -ab, so Var(sum of d - sum of e^2) = sum of 4 v^2 exactly,
// whatever the distribution of a and b. Over channels it is 4 tr(V^2), with V the covariance of the channels
// of D. Divided by the square of the sum of tr V, it depends only on how unevenly noise is spread over pixels
// and channels:
//   relative variance = 4 sum tr(V^2) / (sum tr V)^2.
// It is estimated from the last round. Let A_o be the mean A of the earlier samples alone, alpha = sqrt(o /
// 2n) (A - A_o), and beta the same for B. Both have expectation 0 and covariance V (for independent samples:
// Var(A - A_o) = Var(A) n / o), and they are independent, since the halves are. So
//   E[(alpha . beta)^2] = tr(V^2)   and   E[(alpha . alpha + beta . beta) / 2] = tr V,
// for each pixel separately, whatever the tails of its noise and the noise of its neighbours. Other estimates
// of tr(V^2) are worse: fourth powers of D depend on the tails, and products of neighbours require noise that
// varies slowly. Choosing between these two by g would add a bias: g depends on the pixel's own D, so large D
// would be missing from one of the sums. With low-discrepancy points the variance of all samples together is
// smaller than V as estimated from the two parts, by some factor. If this factor is the same for all pixels,
// it cancels in the relative variance.
//
// Pixels that share paths (docs/decisions/0036-path-reuse.md) have correlated errors. With C_pq the
// covariance of D in pixels p and q, the variance is 4 times the sum over all pairs of tr(C_pq C_qp), not
// over pixels alone. Pairs within squares of 16 x 16 pixels are included by
//   E[(sum over the pixels p of a square of alpha_p . beta_p)^2] = sum over p, q of tr(C_pq C_qp).
// The sum over S squares has a relative standard deviation of about sqrt(2 / S). So its excess over the sum
// over pixels is multiplied by S / (S + 16).
//
// There is another estimate, which is the only one if the last round, or the rounds before it, have too few
// samples. Its tr(V^2) is a weighted mean of those two other estimates, with the weights g^2 and 1 - g^2 in
// each pixel:
//   From the pixel's own fourth powers. Let D_c be the D of channel c. For Gaussian D, E[D_c^4] = 3 V_cc^2
//   and E[D_c^2 D_k^2] = V_cc V_kk (1 + 2 r^2), where r is the correlation of the channels c and k. Hence
//     tr V^2 = sum_c E[D_c^4] / 3  +  sum_{c != k} E[D_c^2 D_k^2] r^2 / (1 + 2 r^2).
//   With grey noise (r = 1) this is E[x^2]/3 for x = sum_c D_c^2. r^2 is taken from products of neighbouring
//   pixels p, q, E[D_c D_k (p) D_c D_k (q)] / E[D_c^2 (p) D_k^2 (q)], a ratio in which image structure
//   cancels. With heavier tails than Gaussian, E[D^4] is larger than 3 v^2.
//
//   From pairs of neighbours p, q, for any distribution: E[(D(p) . D(q))^2] = tr V(p) V(q), since their D are
//   independent. This equals tr(V^2) where V varies slowly from pixel to pixel, as it does in smooth parts of
//   the image, where g is small.
//
// Where pixels next to each other differ in their noise, as with few samples of rare light, this is too low,
// and fourth powers alone (g = 1) are too high: of a trusted image their geometric mean is used. The estimate
// from the last round is right in the mean, but where noise is skewed it is too low in most images and far
// too high in a few. So the standard deviation is the mean of that from the last round and that from the
// geometric mean.
// If the image's figures are not trusted (ImageError::trusted), the interval is from fourth powers alone, and
// wider.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "core/image/error/area_error.h"
#include "core/image/frame/frame.h"
#include "core/image/frame/rounds.h"

namespace ls {

// Sums of the changes of the half means in the last round. alpha and beta are defined in the derivation
// above.
struct ChangeSums {
  double squares = 0;   // sum over pixels of (alpha . alpha + beta . beta) / 2
  double products = 0;  // sum over pixels of (alpha . beta)^2
  // sum over squares of 16 x 16 pixels of (sum of alpha . beta)^2; 0 if the last round has too few samples
  double square_products = 0;
  bool operator==(const ChangeSums&) const = default;
};

// Sums over the pixels of one tile. The sums of several tiles can be added. r, g, D and V are defined in the
// derivation above.
struct NoiseSums {
  double squares = 0;                             // sum over pixels and channels of D^2
  double channel_fourth = 0;                      // sum over pixels and channels of D^4
  double pixel_fourth = 0;                        // sum over pixels of (sum over channels of D^2)^2
  double pair_covariance = 0, pair_variance = 0;  // numerator and denominator of r^2
  // like channel_fourth and pixel_fourth, but with the weight g^2 for each pixel
  double edge_channel_fourth = 0, edge_pixel_fourth = 0;
  double flat_pairs = 0;  // sum over pixels p: (1 - g^2) times the mean over neighbours q of (D(p) . D(q))^2
  double largest = 0;     // largest (sum over channels of D^2) in any pixel
  // sum of D^2 over the channels of the pixels in which one half of the samples has more than 4 times as much
  // light as the other
  double one_sided = 0;
  // The sums from which the interval of a trusted image is computed. If the last round has too few samples,
  // changes.squares is equal to NoiseSums::squares, and changes.products is the sum of tr(V^2) estimated from
  // the sums above.
  ChangeSums changes;
  void add(const NoiseSums& other);
  bool operator==(const NoiseSums&) const = default;
};

struct TileError {
  std::uint64_t pixels = 0;
  std::uint64_t samples = 0;  // total number of samples of all pixels
  // Number of pixels with few hits, where a hit is a sample that found light. The light of such a pixel came
  // from very few samples, so neither its value nor the difference of its halves is reliable. A pixel is
  // counted if one half of its samples has more than 19 times as much light as the other, or if both halves
  // have none and more than half of the neighbours in its window have some. (k equal hits all fall into one
  // half with probability 2^-(k-1). So half of the pixels with 2 hits are counted, one in 16 of those with 5,
  // and one in 500 of those with 10.)
  std::uint64_t few_hits = 0;
  std::uint64_t lit = 0;  // number of pixels in which some sample found light
  NoiseSums plain;        // sums of D, the noise in linear values
  // the same sums with sqrt(w) D in place of D, w = 1 / (m^2 + 0.01)
  NoiseSums relative;
  // amount that was subtracted from relative.squares because the noise is skewed; it is negative if skewed
  // noise made the sum too low
  double skew = 0;
  // The sum of squared relative errors with weights from independent samples, minus relative.squares; 0 if
  // the rounds do not have equally many samples
  double other_weights = 0;
  double unsure_weights = 0;  // sum over pixels of delta^2, for outliers that may be bright pixels
  AreaSums areas;
  void add(const TileError& other);
  void subtract_skew(double part);
  bool operator==(const TileError&) const = default;
};

// The means of the two halves (A and B) of a tile's samples: for each half the planes R, G, B of width *
// height values, row by row.
struct HalfMeans {
  int width = 0, height = 0;
  std::span<const double> a, b;
  std::size_t pixels() const { return static_cast<std::size_t>(width) * static_cast<std::size_t>(height); }
};
// The half means of the tile after an earlier round, that is, from the first part of its samples.
struct EarlierMeans {
  HalfMeans halves;
  // samples per pixel after that round: at least 2, and fewer than in the later half means
  std::uint64_t spp = 0;
};
// Estimates the error of a tile. `spp` is the number of samples per pixel of both halves together. Without
// `earlier`, skewed noise is not corrected, and the interval assumes Gaussian noise.
TileError estimate_error(const HalfMeans& halves, std::uint64_t spp, const EarlierMeans* earlier = nullptr);
// Estimates the error of a tile of meters (core/image/frame/meter_blocks.h), where the figures are those of
// the means over blocks: as the pixels of a block are independent, the squared error of its mean is that of
// its pixels divided by their number. The weight is that of the block's mean m, less the bias that the noise
// of m causes (relative_weight()). It hardly depends on the value of a single pixel, so that no skew needs to
// be corrected. The corner of the tile is that of a block.
TileError estimate_meter_error(const HalfMeans& halves, std::uint64_t spp, const EarlierMeans* earlier);
// Returns 1 / (m^2 + 0.01), minus the bias that is caused by noise of variance `s2` in `m`.
double relative_weight(double m, double s2);
// Returns true if TileError::few_hits counts the pixel (x, y).
bool has_few_hits(const HalfMeans& halves, int x, int y);

// The error figures shown to the user.
struct ImageError {
  // root mean squared error, and the 95 % interval of this image's realised error. The interval is unknown
  // (both ends are 0) if the image is trusted, but so few bright pixels carry this error that it is not
  // known, or that brighter ones may not have been found yet.
  double rmse = 0, rmse_lo = 0, rmse_hi = 0;
  // the interval contains what is unknown of the weights, too
  double relmse = 0, relmse_lo = 0, relmse_hi = 0;
  // True if the pixels with the largest error, not weighed, have light in both halves. Otherwise rare light
  // may be missing from the mean of the image, too.
  bool settled = false;
  double spp = 0;  // samples per pixel, averaged over all pixels
  // The number of pixels that carry the error: (sum of x)^2 / (sum of x^2), where x is the squared relative
  // error of a pixel.
  double effective_pixels = 0;
  double top_share = 0;        // share of the squared relative error that is in the worst pixel
  std::uint64_t few_hits = 0;  // as TileError::few_hits, over the whole image
  // False if the figures and their intervals are unreliable. This is so in four cases: no sample has found
  // light; the halves are equal and have fewer than 64 samples per pixel; few pixels carry the error; or
  // single pixels have far more noise than their neighbours. The last two are no reason if the noise is that
  // of pixels with light in both halves, such as those at the edge of a lamp (NoiseSums::one_sided).
  bool trusted = false;
  bool lit = false;     // some sample has found light
  std::string verdict;  // why the figures are not trusted, in words; empty when trusted
};
ImageError image_error(const TileError& sums);

// Collects the error figures of all tiles after each round. A checkpoint has the figures of the whole image
// after one round. It is the sum over all tiles in tile order, so it does not depend on the order in which
// results arrive. A tile that stopped before this round counts with its last figures.
class Checkpoints {
 public:
  explicit Checkpoints(TileIndex tiles) : tiles_(tiles), waiting_(tiles) {}

  // Records a tile's figures. Call it after each fold (addition of the sums of one round to the film). A
  // round is repeated if the full round replaces a truncated one, or if the tile was restarted. In this case
  // the figures replace those of the tile from that round on, except in checkpoints that are already
  // complete: these are final.
  void folded(TileIndex tile, RoundIndex round, const TileError& error);
  // Declares that no more rounds will follow for this tile, unless folded() is called for it again.
  void stopped(TileIndex tile);

  // Each round is a checkpoint. It is complete if every tile has reached it or has stopped before it.
  // complete() returns the number of complete rounds; at() returns the image's figures after one of them.
  RoundIndex complete() const { return static_cast<RoundIndex>(done_.size()); }
  const TileError& at(RoundIndex round) const { return done_[round]; }

 private:
  struct Tile {
    std::vector<TileError> pending;  // figures of the rounds complete(), complete() + 1, ...
    TileError last;
    RoundIndex reached = 0;  // the last folded round, plus 1
    bool stopped = false;
  };
  bool ready(const Tile& tile) const;  // returns true if the next checkpoint can have the tile's figures
  void change(TileIndex index, const std::function<void(Tile&)>& edit);
  void settle();

  std::vector<Tile> tiles_;
  TileIndex waiting_ = 0;  // number of tiles for which ready() is false
  std::vector<TileError> done_;
};

}  // namespace ls
