#include "cli/true_error.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace ls::cli {
namespace {
constexpr double kRelativeFloor = 0.01;
}

Result<TrueError> TrueError::make(TileGrid grid, RgbImage reference) {
  if (reference.size != grid.frame)
    return fail(
        Errc::invalid_argument,
        fmt::format("the reference is {} x {}, the image {} x {}: they must have one size",
                    reference.size.width, reference.size.height, grid.frame.width, grid.frame.height));
  const auto bad =
      std::count_if(reference.rgb.begin(), reference.rgb.end(), [](float v) { return !std::isfinite(v); });
  if (bad > 0)
    return fail(Errc::invalid_argument,
                fmt::format("the reference has {} values that are NaN or infinite", bad));
  return TrueError(grid, std::move(reference));
}

Result<void> TrueError::add(TileIndex tile, RoundIndex round, Partial partial) {
  if (round < film_.rounds_folded(tile)) return {};
  partial.aovs = {};  // the error is that of the colour
  partial.sums.resize(static_cast<std::size_t>(kPartialChannels * partial.header.tile.pixels()));
  waiting_.insert_or_assign(std::pair(tile, round), std::move(partial));
  for (auto next = waiting_.find({tile, film_.rounds_folded(tile)}); next != waiting_.end();
       next = waiting_.find({tile, film_.rounds_folded(tile)})) {
    const auto folded = film_.fold(tile, next->first.second, next->second);
    waiting_.erase(next);
    if (!folded) return tl::unexpected(folded.error());
    rounds_[tile].push_back(figures(tile));
  }
  return {};
}

TrueError::Figures TrueError::figures(TileIndex tile) const {
  const TilePixels pixels = film_.pixels(tile);
  Figures f{pixels.spp, 0, 0};
  std::size_t i = 0;
  for (int y = pixels.rect.y0; y < pixels.rect.y1; ++y)
    for (int x = pixels.rect.x0; x < pixels.rect.x1; ++x)
      for (std::size_t c = 0; c < 3; ++c, ++i) {
        const auto at = static_cast<std::size_t>(y) * static_cast<std::size_t>(reference_.size.width) +
                        static_cast<std::size_t>(x);
        const double ref = reference_.rgb[3 * at + c], d = pixels.mean[i] - ref;
        f.squares += d * d;
        f.relative += d * d / (ref * ref + kRelativeFloor);
      }
  return f;
}

std::vector<TrueError::Point> TrueError::points(std::span<const RoundIndex> folded) const {
  std::size_t most = 0;
  std::vector<std::size_t> counts(rounds_.size());
  for (std::size_t t = 0; t < rounds_.size(); ++t) {
    counts[t] = std::min<std::size_t>(rounds_[t].size(), t < folded.size() ? folded[t] : 0);
    if (counts[t] == 0) return {};
    most = std::max(most, counts[t]);
  }
  std::vector<Point> all;
  const TileGrid& grid = film_.grid();
  const double pixels = static_cast<double>(grid.frame.width) * grid.frame.height;
  for (std::size_t round = 0; round < most; ++round) {
    std::uint64_t samples = 0;
    double squares = 0, relative = 0;
    for (std::size_t t = 0; t < rounds_.size(); ++t) {
      const Figures& f = rounds_[t][std::min(round, counts[t] - 1)];
      samples += f.spp * static_cast<std::uint64_t>(grid.rect(static_cast<TileIndex>(t)).pixels());
      squares += f.squares;
      relative += f.relative;
    }
    all.push_back(
        {static_cast<double>(samples) / pixels, std::sqrt(squares / (3 * pixels)), relative / (3 * pixels)});
  }
  return all;
}

}  // namespace ls::cli
