#include "cli/commands/verify_image.h"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>
#include <random>

#include "common/image/film/film.h"
#include "common/image/frame/rounds.h"

namespace ls::cli {

std::vector<TileIndex> random_tiles(TileIndex all, std::uint64_t count, std::uint64_t seed) {
  std::vector<TileIndex> tiles(all);
  std::iota(tiles.begin(), tiles.end(), TileIndex{0});
  if (count >= all) return tiles;
  std::mt19937_64 random(seed);
  std::vector<TileIndex> chosen;
  std::sample(tiles.begin(), tiles.end(), std::back_inserter(chosen), static_cast<std::ptrdiff_t>(count),
              random);
  return chosen;
}

VerifiedTile verify_tile(const render::World& world, const SealedImage& image, TileIndex tile,
                         const std::atomic<bool>& stop) {
  VerifiedTile out{tile, image.grid().rect(tile), 0, false, {}};
  const auto spp = tile_samples(image, tile);
  if (!spp) {
    out.problem = spp.error().message;
    return out;
  }
  out.spp = *spp;
  const AovSet aovs = aovs_of(image.settings);
  Film film(image.grid(), aovs);
  const Digest settings = digest_of(image.settings);
  for (RoundIndex k = 0; *spp > 0 && k < round_count(*spp); ++k) {
    const SampleRange samples = cut_range(k, *spp);
    render::TileResult rendered = render::render_tile(world, out.rect, samples, &stop, nullptr);
    if (rendered.stopped) {
      out.stopped = true;
      return out;
    }
    const Partial partial{
        {image.scene, settings, image.numeric_class, out.rect, samples}, std::move(rendered.sums), aovs};
    if (const auto folded = film.fold(tile, k, partial); !folded) {
      out.problem = folded.error().message;
      return out;
    }
  }
  if (film.tile_digest(tile) != image.tiles[tile])
    out.problem = fmt::format("rendered again it is {}, the image seals {}", film.tile_digest(tile).hex(),
                              image.tiles[tile].hex());
  else if (const auto pixel = first_difference(image, film, tile))
    out.problem = fmt::format(
        "its seal is right, but pixel {},{} has another value in layer {} than its samples give: the image "
        "was changed afterwards",
        pixel->x, pixel->y, pixel->layer);
  out.error = film.error(tile);
  return out;
}

std::vector<std::string> wrong_headers(const SealedImage& image, const CryptomatteManifests& names,
                                       const std::vector<VerifiedTile>& tiles) {
  auto expected = final_layers(Film(image.grid(), aovs_of(image.settings)).row(0), names, true).strings;
  expected["lightshaft:seed"] = fmt::format("{}", image.settings.seed);
  const bool all = tiles.size() == image.grid().count() &&
                   std::none_of(tiles.begin(), tiles.end(), [](const auto& t) { return t.stopped; });
  if (all) {
    TileError sums;
    std::uint64_t missing = 0;
    for (const VerifiedTile& t : tiles) {
      if (t.spp > 0) sums.add(t.error);
      if (t.spp == 0) missing += static_cast<std::uint64_t>(t.rect.pixels());
    }
    expected.merge(error_strings(sums, missing));
    expected.erase("lightshaft:verdict");  // also depends on the convergence curve, which is unknown here
  }
  std::vector<std::string> wrong;
  for (const auto& [name, value] : expected) {
    const auto found = image.picture.strings.find(name);
    if (found == image.picture.strings.end() || found->second != value) wrong.push_back("header " + name);
  }
  return wrong;
}

}  // namespace ls::cli
