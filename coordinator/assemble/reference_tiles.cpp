#include "coordinator/assemble/reference_tiles.h"

#include <algorithm>
#include <limits>

#include "coordinator/assemble/round_errors.h"

namespace ls::coordinator {

ReferenceTiles::ReferenceTiles(const Film& film) : tiles_(film.grid().count()) {
  for (TileIndex t = 0; t < tiles_.size(); ++t) {
    tiles_[t].rect = film.grid().rect(t);
    if (const RoundIndex rounds = film.rounds_folded(t); rounds > 0) folded(t, rounds - 1, film);
  }
}

void ReferenceTiles::folded(TileIndex tile, RoundIndex round, const Film& film) {
  auto& rounds = tiles_[tile].rounds;
  while (!rounds.empty() && rounds.back().first >= round) rounds.pop_back();
  const TilePixels pixels = film.pixels(tile);
  rounds.emplace_back(round,
                      std::make_shared<const std::vector<float>>(pixels.mean.begin(), pixels.mean.end()));
}

std::optional<std::vector<TilePicture>> ReferenceTiles::at(std::span<const RoundIndex> rounds) const {
  std::vector<TilePicture> out;
  for (std::size_t t = 0; t < tiles_.size(); ++t) {
    TilePicture found{tiles_[t].rect, nullptr};
    for (const auto& [round, rgb] : tiles_[t].rounds)
      if (round < rounds[t]) found.rgb = rgb;
    if (!found.rgb) return std::nullopt;
    out.push_back(std::move(found));
  }
  return out;
}

std::optional<std::vector<TilePicture>> ReferenceTiles::latest() const {
  return at(std::vector<RoundIndex>(tiles_.size(), std::numeric_limits<RoundIndex>::max()));
}

void ReferenceTiles::checkpoint_taken(std::span<const RoundIndex> rounds) {
  for (std::size_t t = 0; t < tiles_.size(); ++t) drop_rounds_before(rounds[t], tiles_[t].rounds);
}

std::vector<float> joined(const std::vector<TilePicture>& tiles, FrameSize frame) {
  const auto width = static_cast<std::size_t>(frame.width);
  std::vector<float> out(3 * width * static_cast<std::size_t>(frame.height));
  for (const TilePicture& tile : tiles) {
    const auto row = 3 * static_cast<std::size_t>(tile.rect.width());
    auto from = tile.rgb->begin();
    for (int y = tile.rect.y0; y < tile.rect.y1; ++y, from += static_cast<std::ptrdiff_t>(row))
      std::copy_n(from, row,
                  &out[3 * (static_cast<std::size_t>(y) * width + static_cast<std::size_t>(tile.rect.x0))]);
  }
  return out;
}

}  // namespace ls::coordinator
