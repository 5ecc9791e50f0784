// The error of means over areas of an image: over the whole image and over squares of 16 x 16 pixels.
//
// The error of an area's mean is the mean of its pixels' errors, so it is small where the pixels' errors are
// independent, and not where they have a part in common: pixels that share paths err alike within squares
// (docs/decisions/0036-path-reuse.md), and with light vertices all pixels have the error of a set in common
// (docs/decisions/0031-connections-to-light-vertices.md). As for pixels (error_estimate.h), half the
// difference of the two half means, averaged over the area, has the variance of the area's error. Let D be
// this value of a pixel.
//
// The mean of the image: if squares are independent, its variance is, per channel,
//   Q / pixels^2,   Q = sum over squares of (sum of D)^2.
// If pixels are independent, too, it is P / pixels^2 with P = sum over pixels of D^2, which is known better.
// Errors that pixels have in common raise Q alone, and with few squares Q is too low in many images: so the
// variance is from Q or, if that is smaller, from the geometric mean of both. The degrees of freedom are
//   3 (sum of x)^2 / (sum of x^2) - 2,   x = (sum of D)^2 of a square: the number of
// squares if all are alike and Gaussian. If all pixels have errors in common, only the mean of D over the
// image tells them. This mean is the sum of a part from the last round and a part from the samples before it.
// If these use different sets of light vertices, the parts are independent, and the sum of their squares has
// two degrees of freedom if both have equally many samples, and fewer otherwise: N^2 / (n^2 + o^2), if n of N
// samples are in the last round and o before it. If the parts are not independent, the square of their sum
// has one. The interval is Student's.
//
// Squares: relMSE of their means is the mean over squares and channels, weighted by pixels, of
//   E^2 / (S^2 + 0.01),   E: the mean of D over the square, S: its mean value.
// The noise of S is neglected. The relative variance of the difference from the realised relMSE is
//   4 sum of v^2 / (sum of v)^2,   v: the expectation of a square's term,
// as for pixels (error_estimate.h). A square's own term says little of v: it has one degree of freedom. The
// sum of D^2 over its pixels is proportional to v if pixels are independent, or equally correlated in all
// squares, and has many. If all pixels have errors in common, two squares have the correlation r of their
// errors, and 4 r^2 is added; r follows from the variance of the image's mean.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace ls {

struct HalfMeans;
struct EarlierMeans;

// Side in pixels of the squares over whose pixels errors may be correlated: those that share paths
// (worker/render/integrator/path_reuse.h)
inline constexpr std::size_t kCorrelatedSide = 16;
// The number of successive samples whose halves use one set of light vertices each: the renderer's
// LightVertexCache::kEpoch
inline constexpr std::uint64_t kSetSamples = 16;
inline constexpr double kNormal95 = 1.959963984540054;  // two-sided 95 % point of the normal distribution

using ChannelSums = std::array<double, 3>;

// Sums over the squares of 16 x 16 pixels of one tile, whose corner is that of a square. The sums of several
// tiles can be added. D and S are defined above.
struct AreaSums {
  ChannelSums values{}, noise{};  // sums over pixels of S and of D
  // Sum over pixels of the part of D that comes from the last round. Cannot be computed from the tile's
  // present samples alone.
  ChannelSums last{};
  // The smallest and largest number of samples per pixel that a tile had before its last round. Neither can
  // be computed from the tile's present samples alone.
  std::uint64_t fewest_before = 0, most_before = 0;
  ChannelSums powers{};              // sum over pixels of D^2
  ChannelSums squares{}, fourths{};  // sums over squares of the 2nd and 4th power of (sum of D)
  double relative = 0;               // sum over squares of pixels * E^2 / (S^2 + 0.01), all channels
  // Sums over squares of u and u^2, where u is the sum over pixels and channels of D^2 / (S^2 + 0.01)
  double spread = 0, spread_squares = 0;
  std::uint64_t samples = 0, pixels = 0, count = 0;  // numbers of pixels and of squares
  void add(const AreaSums& other);
  bool operator==(const AreaSums&) const = default;
};
// `earlier` is null in the first round.
AreaSums area_sums(const HalfMeans& halves, std::uint64_t spp, const EarlierMeans* earlier);

// Number of squares at which what correlated errors add to a variance gets the weight 1/2. The sum over this
// many squares is known to a third. The weight approaches 1 in images of many squares.
inline constexpr double kHalfWeightSquares = 16;

struct AreaError {
  ChannelSums mean{};        // mean of the image in each channel
  ChannelSums half_width{};  // half the width of its 95 % interval
  // relMSE of the means over squares, and the 95 % interval of this image's realised error; both ends are 0
  // if too few squares carry the error for an interval
  double relmse = 0, relmse_lo = 0, relmse_hi = 0;
};
// `common`: all pixels have errors in common (light vertices). All figures are 0 without pixels.
AreaError area_error(const AreaSums& sums, bool common);

}  // namespace ls
