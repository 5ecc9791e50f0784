// Images whose true values are known, sampled without a renderer. A pixel's samples have a gamma distribution
// about its mean, and occasionally one is a firefly. A round (range of samples) adds the sum of its samples,
// which is drawn at once (sums of gamma variables are gamma variables, counts of fireflies binomial), so that
// a thousand jobs take seconds. Tiles stop by the farm's own rule and error estimate.
#pragma once

#include <array>
#include <cmath>
#include <functional>
#include <random>
#include <span>
#include <string>
#include <vector>

#include "coordinator/domain/adaptive_stop.h"
#include "coordinator/domain/limits.h"
#include "core/image/error/error_estimate.h"
#include "tests/unit/domain/stop_oracle.h"

namespace ls::test {

struct SyntheticPixel {
  double mean = 1;     // without fireflies
  double spread = 1;   // standard deviation of a sample divided by `mean`
  double chance = 0;   // probability that a sample is a firefly
  double firefly = 0;  // value of a firefly
  double truth() const { return mean + chance * firefly; }
  double variance() const {
    return spread * spread * mean * mean + chance * (1 - chance) * firefly * firefly;
  }
};

// A pixel's channels are its grey value times these factors.
inline constexpr double kGrey[3] = {1, .8, .6};

class SyntheticFilm {
 public:
  SyntheticFilm(TileGrid grid, const std::function<SyntheticPixel(int x, int y)>& pixel) : grid_(grid) {
    for (TileIndex t = 0; t < grid.count(); ++t) {
      const PixelRect r = grid.rect(t);
      for (int y = r.y0; y < r.y1; ++y)
        for (int x = r.x0; x < r.x1; ++x) pixels_.push_back(pixel(x, y));
      first_.push_back(pixels_.size());
    }
  }

  const TileGrid& grid() const { return grid_; }
  std::span<const SyntheticPixel> tile(TileIndex t) const {
    const std::size_t from = t == 0 ? 0 : first_[t - 1];
    return std::span(pixels_).subspan(from, first_[t] - from);
  }
  std::size_t pixels() const { return pixels_.size(); }

  // relMSE times the number of samples, of the tile or the image: n samples, evenly distributed, give this
  // value divided by n.
  double relative_variance(TileIndex t) const {
    double sum = 0;
    for (const SyntheticPixel& p : tile(t)) sum += relative(p, p.variance());
    return sum / static_cast<double>(tile(t).size());
  }
  double relative_variance() const {
    double sum = 0;
    for (TileIndex t = 0; t < grid_.count(); ++t)
      sum += relative_variance(t) * static_cast<double>(tile(t).size());
    return sum / static_cast<double>(pixels());
  }
  // The mean over channels of square / (truth^2 + 0.01), where `square` is the square of a difference in the
  // grey value. Each channel multiplies difference and truth by its factor.
  static double relative(const SyntheticPixel& p, double square) {
    double sum = 0;
    for (const double w : kGrey) sum += w * w * square / (w * w * p.truth() * p.truth() + .01);
    return sum / 3;
  }

 private:
  TileGrid grid_;
  std::vector<SyntheticPixel> pixels_;
  std::vector<std::size_t> first_;  // one past each tile's last pixel
};

// One job: sums of both halves of every pixel, round by round, with random numbers from a seed.
class SyntheticJob {
 public:
  SyntheticJob(const SyntheticFilm& film, std::uint64_t seed)
      : film_(film),
        seed_(seed),
        sums_(film.grid().count()),
        before_(film.grid().count()),
        rounds_(film.grid().count()) {}

  // Adds the samples of the tile's next round. Returns the new estimate of the tile's sum of squared relative
  // errors.
  double fold(TileIndex t) {
    const auto pixels = film_.tile(t);
    auto& sums = sums_[t];
    sums.resize(2 * pixels.size());
    before_[t] = sums;
    const RoundIndex round = rounds_[t]++;
    const double half = static_cast<double>(round_range(round).count()) / 2;
    std::mt19937_64 random(seed_ * 0x9e3779b97f4a7c15ull + t * 0xc2b2ae3d27d4eb4full + round);
    for (std::size_t i = 0; i < sums.size(); ++i) {
      const SyntheticPixel& p = pixels[i % pixels.size()];
      const double shape = 1 / (p.spread * p.spread);
      sums[i] += std::gamma_distribution(half * shape, p.mean / shape)(random);
      if (p.chance > 0)
        sums[i] += p.firefly * std::binomial_distribution<int>(static_cast<int>(half), p.chance)(random);
    }
    return estimate(t).relative.squares;
  }

  TileError estimate(TileIndex t) const {
    const PixelRect rect = film_.grid().rect(t);
    const RoundIndex last = rounds_[t] - 1;
    const auto now = means(sums_[t], round_range(last).s1);
    const HalfMeans halves{rect.width(), rect.height(), now[0], now[1]};
    if (last == 0) return estimate_error(halves, round_range(last).s1);
    const auto before = means(before_[t], round_range(last - 1).s1);
    const EarlierMeans earlier{{rect.width(), rect.height(), before[0], before[1]}, round_range(last - 1).s1};
    return estimate_error(halves, round_range(last).s1, &earlier);
  }

  // Returns the image's value minus the true value of every pixel, in the order of tiles.
  std::vector<double> errors() const {
    std::vector<double> out;
    for (TileIndex t = 0; t < film_.grid().count(); ++t) {
      const auto pixels = film_.tile(t);
      const double spp = static_cast<double>(round_range(rounds_[t] - 1).s1);
      for (std::size_t i = 0; i < pixels.size(); ++i)
        out.push_back((sums_[t][i] + sums_[t][pixels.size() + i]) / spp - pixels[i].truth());
    }
    return out;
  }

 private:
  // Returns the means of both halves: planes of three channels each.
  static std::array<std::vector<double>, 2> means(const std::vector<double>& sums, std::uint64_t spp) {
    const std::size_t n = sums.size() / 2;
    std::array<std::vector<double>, 2> out;
    for (std::size_t h = 0; h < 2; ++h)
      for (const double weight : kGrey)
        for (std::size_t i = 0; i < n; ++i)
          out[h].push_back(weight * sums[h * n + i] * 2 / static_cast<double>(spp));
    return out;
  }

  const SyntheticFilm& film_;
  std::uint64_t seed_;
  std::vector<std::vector<double>> sums_;    // for each tile: half A, followed by half B
  std::vector<std::vector<double>> before_;  // the same, before the tile's last round
  std::vector<RoundIndex> rounds_;
};

struct StoppedJob {
  coordinator::StopOutcome stop;
  double estimated = 0, realised = 0;  // relMSE
  std::vector<double> errors;
};

// Runs a job to its target as the farm does.
inline StoppedJob run_to_target(const SyntheticFilm& film, double target, std::uint64_t seed) {
  SyntheticJob job(film, seed);
  StoppedJob out;
  coordinator::AdaptiveStop rule(film.grid(), coordinator::kMaxSppWithoutLimit);
  std::vector<RoundIndex> seen(film.grid().count());
  const coordinator::ErrorOf error = [&](TileIndex t, RoundIndex) { return job.fold(t); };
  out.stop = coordinator::stop_at(rule, seen, target, error);
  coordinator::feed_wanted(rule, seen, error);
  TileError sum;
  for (TileIndex t = 0; t < film.grid().count(); ++t) sum.add(job.estimate(t));
  out.estimated = image_error(sum).relmse;
  out.errors = job.errors();
  std::size_t i = 0;
  for (TileIndex t = 0; t < film.grid().count(); ++t)
    for (const SyntheticPixel& p : film.tile(t)) {
      out.realised += SyntheticFilm::relative(p, out.errors[i] * out.errors[i]);
      ++i;
    }
  out.realised /= static_cast<double>(film.pixels());
  return out;
}

// A synthetic image.
struct SyntheticScene {
  std::string name;
  std::function<SyntheticPixel(int x, int y)> pixel;
};

// For frames with tiles of 32 pixels. The tiles differ in their noise.
inline std::vector<SyntheticScene> synthetic_scenes() {
  const auto tile_number = [](int x, int y) { return (x / 32) * 7 + (y / 32) * 13; };
  const auto smooth = [](int x, int y) { return .6 + .5 * std::sin(x * .021) * std::cos(y * .033); };
  return {
      {"even noise",
       [=](int x, int y) {
         return SyntheticPixel{smooth(x, y), 1, 0, 0};
       }},
      {"uneven noise",
       [=](int x, int y) {
         return SyntheticPixel{smooth(x, y), .08 * std::exp2(tile_number(x, y) % 6), 0, 0};
       }},
      {"a shaft in a calm room",
       [=](int x, int y) {
         return SyntheticPixel{smooth(x, y), (x + y) / 32 % 8 == 2 ? 4. : .25, 0, 0};
       }},
      {"dark",
       [=](int x, int y) {
         return SyntheticPixel{.02 * smooth(x, y), .5 * std::exp2(tile_number(x, y) % 5), 0, 0};
       }},
      {"fireflies",
       [=](int x, int y) {
         return SyntheticPixel{smooth(x, y), .25, tile_number(x, y) % 3 == 0 ? 2e-4 : 0, 40};
       }},
      {"rare fireflies",
       [=](int x, int y) {
         return SyntheticPixel{smooth(x, y), .5, tile_number(x, y) % 4 == 0 ? 4e-6 : 0, 300};
       }},
  };
}

}  // namespace ls::test
