// How large the error of an image is, told from the image itself.
//
// A pixel's two half means A and B are independent and have the same expectation. With a, b their errors, the
// image (A+B)/2 has the error e = (a+b)/2, and D = (A-B)/2 = (a-b)/2 has the same variance v as e: d = D^2 is
// an unbiased estimate of E[e^2]. Sums of d over pixels and channels give the mean squared error; sums of w
// d, with w = 1/(window^2 + 0.01), the relative one.
//
// The window is the 5 x 5 average around the pixel, of both halves, the pixel itself left out and clipped to
// the tile. The pixel is left out because a firefly in it would enlarge its own denominator and hide half of
// its error; without it the window is independent of d, whatever the halves. (A tile of one pixel has no
// neighbours: it uses the pixel.) The noise of the window, variance s^2, biases 1/(m^2 + c), c = 0.01, by no
// more than s^2 (m^2 + c) / c^2 of its value (Taylor, |f''| <= 2/c^2), hence by at most s^2/c where it is
// dark.
//
// Interval of the realised error: d - e^2 = -ab, so Var(sum of d - sum of e^2) = sum of 4 v^2 exactly,
// whatever the distribution of a and b; over channels, 4 tr(V^2) with V the covariance of the channels of D.
// For Gaussian D E[D_c^4] = 3 V_cc^2 and E[D_c^2 D_k^2] = V_cc V_kk (1 + 2 r^2), r the correlation of two
// channels, hence
//   tr V^2 = sum_c E[D_c^4] / 3  +  sum_{c != k} E[D_c^2 D_k^2] r^2 / (1 + 2 r^2).
// With grey noise (r = 1) this is E[x^2]/3 for x = sum_c D_c^2, and the variance 4/3 sum x^2. r^2 is taken
// from products of neighbouring pixels p, q, E[D_c D_k (p) D_c D_k (q)] / E[D_c^2 (p) D_k^2 (q)], a ratio in
// which image structure cancels. Heavier tails than Gaussian make E[D^4] larger than 3 v^2: the interval errs
// on the wide side.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "common/image/frame.h"
#include "common/image/rounds.h"

namespace ls {

// Sums over the pixels of one tile (or of many: they add).
struct NoiseSums {
  double squares = 0;                             // sum over pixels and channels of D^2
  double channel_fourth = 0;                      // sum over pixels and channels of D^4
  double pixel_fourth = 0;                        // sum over pixels of (sum over channels of D^2)^2
  double pair_covariance = 0, pair_variance = 0;  // numerator and denominator of r^2
  double largest = 0;                             // largest sum over channels of D^2 of one pixel
  void add(const NoiseSums& other);
  bool operator==(const NoiseSums&) const = default;
};

struct TileError {
  std::uint64_t pixels = 0;
  std::uint64_t samples = 0;  // spp x pixels
  NoiseSums plain;            // of D
  NoiseSums relative;         // of D / sqrt(window^2 + 0.01)
  void add(const TileError& other);
  bool operator==(const TileError&) const = default;
};

// Half means of a tile, planar: R, G, B planes of rect.pixels() each, row by row.
struct HalfMeans {
  int width = 0, height = 0;
  std::span<const double> a, b;
};
// `spp`: samples per pixel behind the means, both halves together.
TileError estimate_error(const HalfMeans& halves, std::uint64_t spp);

// What the user is told.
struct ImageError {
  double rmse = 0, rmse_lo = 0, rmse_hi = 0;  // 95 % interval for the realised error of this very image
  double relmse = 0, relmse_lo = 0, relmse_hi = 0;
  double spp = 0;               // mean over pixels
  double effective_pixels = 0;  // (sum x)^2 / sum x^2 of the relative error: how many pixels carry it
  double top_share = 0;         // share of the relative error that stands in one pixel
  bool trusted = false;         // false: few pixels carry the error, the interval means little yet
  std::string verdict;          // in words; empty when trusted
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
