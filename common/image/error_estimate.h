// How large the error of an image is, told from the image itself.
//
// A pixel's two half means A and B are independent and have the same expectation. With a, b their errors, the
// image (A+B)/2 has the error e = (a+b)/2, and D = (A-B)/2 = (a-b)/2 has the same variance v as e: d = D^2 is
// an unbiased estimate of E[e^2]. Sums of d over pixels and channels give the mean squared error; sums of w
// d, with w = 1/(m^2 + 0.01) and m the pixel's right value, the relative one.
//
// What stands for m must be free of the noise that is being measured: S = (A+B)/2 itself would let a firefly
// enlarge its own denominator and hide most of its error, and the average W of the neighbours alone is wrong
// wherever a picture has edges (docs/measurements/error.md has figures of both). So, per channel,
//   m = W + g (S - W),   g = T / (T + v),
// local Wiener filtering (Lee 1980) with
//   W   the mean of the 5 x 5 window without the pixel, clipped to the tile;
//   u   the window's mean of D^2;
//   v   the noise: u, or D^2 of the pixel where that is beyond T + u (a firefly has D^2 = (S - W)^2);
//   T   the picture's structure: the window's variance of S less its noise u; or (S - W)^2 where that is
//       beyond 9 u and 9 D^2, three standard deviations, as of a small bright thing.
// In a flat or dark place g is near 0 and m does not depend on the pixel; where the picture's structure
// exceeds its noise g is near 1. A tile of one pixel uses S. The noise that is left in m, of variance s^2 =
// g^2 u + (1 - g)^2 u / n (n: the window's pixels), would bias f = 1/(m^2 + c), c = 0.01,
// by f" s^2 / 2: that is subtracted, within [f/2, 2 f]. What remains is of second order: in the dark 3 s^4 /
// c^2 of the value.
//
// Where g is near 1 the pixel's value is in its own weight, and the noise of rendered pixels is skewed: a
// bright sample raises D^2 and S alike, and the sum of f D^2 comes out too low, to first order by f'(m) g
// cov(D^2, S), which falls like 1/N as a share (2 % at 64 samples, docs/measurements/error.md). The samples
// of the last round, independent of those before, tell it: with n of N samples in the last round, o before
// it, and D, S of the parts so named,
//   E[D_n^2 (S_n - S_o)] = k / n^2  and  E[D_o^2 (S_o - S_n)] = k / o^2,
// k the third cumulant of a sample; the pixel's right value drops out of the difference. cov(D^2, S) is k /
// N^2, so
//   t = ((n D_n / N)^2 (n / N) - (o D_o / N)^2 (o / N)) (S_n - S_o)
// has it as its expectation, and f'(m) g t is subtracted. (To first order the square of the last samples'
// difference is weighted as the earlier ones would have it, and the reverse.) Neither weight is changed by
// more than half of itself. The first round has nothing before it and is taken as it is.
//
// Interval of the realised error: d - e^2 = -ab, so Var(sum of d - sum of e^2) = sum of 4 v^2 exactly,
// whatever the distribution of a and b; over channels, 4 tr(V^2) with V the covariance of the channels of D.
// Over the square of the sum of tr V that is a matter of how unevenly noise is spread over pixels and
// channels, and of nothing else:
//   relative variance = 4 sum tr(V^2) / (sum tr V)^2.
// The last round tells it. With o samples before it and n in it, alpha = sqrt(o / 2n) (A - A_o) of the one
// half and beta of the other are independent, since the halves are; each has the expectation 0 and the
// covariance V (for independent samples: Var(A - A_o) = Var(A) n / o). So
//   E[(alpha . beta)^2] = tr(V^2)   and   E[(alpha . alpha + beta . beta) / 2] = tr V,
// of each pixel by itself, whatever the tails of its noise and whatever noise its neighbours have. Fourth
// powers of D would ask for the tails, products of neighbours for noise that changes slowly, and a choice
// between the two by a g that looks at the pixel's own D takes the large ones out of its sum. Points of low
// discrepancy make the whole better than its parts by some factor: where it is the same for all pixels it
// drops out.
//
// The first rounds, of too few samples to be told apart, and a last round that is cut to a few have two other
// ways to tr(V^2), and each pixel takes its share g^2 of the first and 1 - g^2 of the second:
//   From its own fourth powers, for Gaussian D: E[D_c^4] = 3 V_cc^2 and E[D_c^2 D_k^2] = V_cc V_kk (1 + 2
//   r^2), r the correlation of two channels, hence
//     tr V^2 = sum_c E[D_c^4] / 3  +  sum_{c != k} E[D_c^2 D_k^2] r^2 / (1 + 2 r^2).
//   With grey noise (r = 1) this is E[x^2]/3 for x = sum_c D_c^2. r^2 is taken from products of neighbouring
//   pixels p, q, E[D_c D_k (p) D_c D_k (q)] / E[D_c^2 (p) D_k^2 (q)], a ratio in which image structure
//   cancels. Heavier tails than Gaussian make E[D^4] larger than 3 v^2.
//
//   From pairs of neighbours, for any distribution: E[(D(p) . D(q))^2] = tr V(p) V(q), as their D are
//   independent. That is tr V^2 where the noise varies slowly, which it does where the picture does: where g
//   is small.
// An image that is not trusted has an interval of fourth powers alone, the wider one.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "common/image/frame.h"
#include "common/image/rounds.h"

namespace ls {

// Of how the means of the halves changed by the last round: alpha and beta of the derivation.
struct ChangeSums {
  double squares = 0;   // sum over pixels of (alpha . alpha + beta . beta) / 2
  double products = 0;  // sum over pixels of (alpha . beta)^2
  bool operator==(const ChangeSums&) const = default;
};

// Sums over the pixels of one tile (or of many: they add).
struct NoiseSums {
  double squares = 0;                                     // sum over pixels and channels of D^2
  double channel_fourth = 0;                              // sum over pixels and channels of D^4
  double pixel_fourth = 0;                                // sum over pixels of (sum over channels of D^2)^2
  double pair_covariance = 0, pair_variance = 0;          // numerator and denominator of r^2
  double edge_channel_fourth = 0, edge_pixel_fourth = 0;  // the fourth powers again, times g^2
  double flat_pairs = 0;  // sum over pixels of 1 - g^2 times the mean of (D(p) . D(q))^2
  double largest = 0;     // largest sum over channels of D^2 of one pixel
  ChangeSums changes;     // where the last round cannot tell: squares, and tr(V^2) in one of the other ways
  void add(const NoiseSums& other);
  bool operator==(const NoiseSums&) const = default;
};

struct TileError {
  std::uint64_t pixels = 0;
  std::uint64_t samples = 0;  // spp x pixels
  // Pixels of which at least one half holds next to nothing of the light, though there is some: what they
  // show came from very few samples, and neither their value nor their difference says much. A pixel counts
  // if one half has 19 times as much as the other, or if both have nothing and more than half of the
  // neighbours in its window have something. (k equal hits fall all into one half once in 2^(k-1): of pixels
  // with 2 hits half are told, with 5 one in 16, with 10 one in 500.)
  std::uint64_t few_hits = 0;
  std::uint64_t lit = 0;  // pixels in which a sample has found light
  NoiseSums plain;        // of D
  NoiseSums relative;     // of D / sqrt(window^2 + 0.01)
  double skew = 0;        // what has been subtracted from relative.squares, since noise is skewed
  void add(const TileError& other);
  void subtract_skew(double part);
  bool operator==(const TileError&) const = default;
};

// Half means of a tile, planar: R, G, B planes of rect.pixels() each, row by row.
struct HalfMeans {
  int width = 0, height = 0;
  std::span<const double> a, b;
};
// The tile as it stood some samples before; those are among the later ones.
struct EarlierMeans {
  HalfMeans halves;
  std::uint64_t spp = 0;  // at least 2, fewer than now
};
// `spp`: samples per pixel behind the means, both halves together. Without `earlier` skewed noise is not
// corrected for, and the interval supposes Gaussian noise.
TileError estimate_error(const HalfMeans& halves, std::uint64_t spp, const EarlierMeans* earlier = nullptr);
// 1 / (m^2 + 0.01) less what noise of m, of variance s2, adds to it in the mean.
double relative_weight(double m, double s2);
// Whether pixel (x, y) is one of few_hits.
bool has_few_hits(const HalfMeans& halves, int x, int y);

// What the user is told.
struct ImageError {
  double rmse = 0, rmse_lo = 0, rmse_hi = 0;  // 95 % interval for the realised error of this very image
  double relmse = 0, relmse_lo = 0, relmse_hi = 0;
  double spp = 0;               // mean over pixels
  double effective_pixels = 0;  // (sum x)^2 / sum x^2 of the relative error: how many pixels carry it
  double top_share = 0;         // share of the relative error that stands in one pixel
  std::uint64_t few_hits = 0;   // pixels
  bool trusted = false;  // false: few pixels carry the error, or there is no light: the interval means little
  std::string verdict;   // in words; empty when trusted
};
ImageError image_error(const TileError& sums);

// Collects the figures of all tiles at each round: a checkpoint is a round over all tiles, summed in tile
// order, so that it does not depend on the order of arrival. A tile that stopped early stands with its last
// figures.
class Checkpoints {
 public:
  explicit Checkpoints(TileIndex tiles) : tiles_(tiles), waiting_(tiles) {}

  // After each fold. A round given again (a cut round replaced by the full one, a tile begun anew) replaces
  // what stood from it on, except in checkpoints that are complete already: those are history.
  void folded(TileIndex tile, RoundIndex round, const TileError& error);
  // No more rounds will come for this tile unless folded() is called for it again.
  void stopped(TileIndex tile);

  // Rounds that all tiles have reached, and the figures of the image there.
  RoundIndex complete() const { return static_cast<RoundIndex>(done_.size()); }
  const TileError& at(RoundIndex round) const { return done_[round]; }

 private:
  struct Tile {
    std::vector<TileError> pending;  // figures of round complete() and those after it
    TileError last;
    RoundIndex reached = 0;  // one past the last round folded
    bool stopped = false;
  };
  bool ready(const Tile& tile) const;  // for the next checkpoint
  void change(TileIndex index, const std::function<void(Tile&)>& edit);
  void settle();

  std::vector<Tile> tiles_;
  TileIndex waiting_ = 0;  // tiles that are not ready
  std::vector<TileError> done_;
};

}  // namespace ls
