// Generated partials and films for the tests of this folder.
#pragma once

#include <cstdint>
#include <random>
#include <vector>

#include "core/image/film/film.h"
#include "core/image/film/partial.h"

namespace ls::test {

inline Digest name_of(std::string_view text) { return sha256(text); }

// Returns sums that are similar to those of a render: positive, of very different magnitudes. They depend
// only on the tile and the samples.
inline Partial make_partial(const TileGrid& grid, TileIndex tile, SampleRange samples) {
  Partial p{{name_of("scene"), name_of("settings"), name_of("class"), grid.rect(tile), samples}, {}};
  // A truncated round has the same seed as the full one, but other sums.
  std::mt19937_64 random(tile * 1000003ull + samples.s0 * 7919ull + 1);
  std::uniform_real_distribution<float> exponent(-6, 6);
  p.sums.resize(static_cast<std::size_t>(p.header.tile.pixels()) * kPartialChannels);
  for (float& v : p.sums) v = std::exp(exponent(random)) * static_cast<float>(samples.count());
  return p;
}

inline Partial make_round(const TileGrid& grid, TileIndex tile, RoundIndex round, std::uint64_t spp) {
  return make_partial(grid, tile, cut_range(round, spp));
}

// Returns a film with all rounds of `spp` samples, folded in order.
inline Film make_film(const TileGrid& grid, std::uint64_t spp) {
  Film film(grid);
  for (TileIndex t = 0; t < grid.count(); ++t)
    for (RoundIndex k = 0; k < round_count(spp); ++k) {
      const auto folded = film.fold(t, k, make_round(grid, t, k, spp));
      if (!folded) throw std::runtime_error(folded.error().message);
    }
  return film;
}

}  // namespace ls::test
