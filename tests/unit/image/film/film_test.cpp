#include "core/image/film/film.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <numeric>
#include <random>
#include <utility>

#include "core/image/exr/final_image.h"
#include "tests/unit/image/support.h"
#include "worker/fake/fake_pixels.h"

namespace ls {
namespace {

using test::make_film;
using test::make_partial;
using test::make_round;
using ::testing::HasSubstr;

const TileGrid kFilmGrid{{20, 13}, 8};

TEST(Film, IsEmptyAtFirst) {
  const Film film(kFilmGrid);

  EXPECT_EQ(film.samples(), 0u);
  EXPECT_EQ(film.memory_bytes(), 0u);
  EXPECT_EQ(film.spp(3), 0u);
  EXPECT_EQ(film.rounds_folded(3), 0u);
  EXPECT_EQ(film.tile_digest(3), Digest{});
  EXPECT_EQ(film.error().pixels, 0u) << "of what is not there nothing is told";
  EXPECT_EQ(film.pixels_without_samples(), 260u);
  EXPECT_EQ(film.pixels(3).mean, std::vector<double>(3u * 8 * 5, 0.0));
}

TEST(Film, MeanIsTheSumOfBothHalvesOverTheirCount) {
  Film film(kFilmGrid);
  Partial first = make_partial(kFilmGrid, 0, {0, 2}), second = make_partial(kFilmGrid, 0, {2, 4});
  ASSERT_TRUE(film.fold(0, 0, first));
  ASSERT_TRUE(film.fold(0, 1, second));

  const TilePixels pixels = film.pixels(0);

  EXPECT_EQ(pixels.spp, 4u);
  for (std::size_t c = 0; c < 3; ++c) {
    for (std::size_t p = 0; p < 64; ++p) {
      const double a = double{first.sums[c * 64 + p]} + second.sums[c * 64 + p];
      const double b = double{first.sums[(c + 3) * 64 + p]} + second.sums[(c + 3) * 64 + p];
      ASSERT_EQ(pixels.mean[3 * p + c], (a + b) / 4);
      ASSERT_EQ(pixels.standard_error[3 * p + c], std::abs(a / 2 - b / 2) / 2);
    }
  }
}

TEST(Film, RequiresRoundsInOrderAndNamesTheNext) {
  Film film(kFilmGrid);
  ASSERT_TRUE(film.fold(1, 0, make_partial(kFilmGrid, 1, {0, 2})));
  const Film before = film;

  const auto early = film.fold(1, 2, make_partial(kFilmGrid, 1, {4, 8}));
  const auto again = film.fold(1, 0, make_partial(kFilmGrid, 1, {0, 2}));

  EXPECT_EQ(early.error().code, Errc::failed_precondition);
  EXPECT_THAT(early.error().message, HasSubstr("round 2 cannot be folded before round 1"));
  EXPECT_EQ(again.error().code, Errc::already_exists);
  EXPECT_EQ(film, before);
}

TEST(Film, RefusesPartialsOfAnotherTileOrRound) {
  Film film(kFilmGrid);
  EXPECT_EQ(film.fold(0, 0, make_partial(kFilmGrid, 1, {0, 2})).error().code, Errc::invalid_argument);
  EXPECT_EQ(film.fold(0, 0, make_partial(kFilmGrid, 0, {2, 4})).error().code, Errc::invalid_argument);
  EXPECT_EQ(film.fold(0, 0, make_partial(kFilmGrid, 0, {0, 4})).error().code, Errc::invalid_argument);
  EXPECT_EQ(film.fold(0, 0, make_partial(kFilmGrid, 0, {0, 1})).error().code, Errc::invalid_argument);
  EXPECT_EQ(film.fold(99, 0, make_partial(kFilmGrid, 0, {0, 2})).error().code, Errc::invalid_argument);
  Partial small = make_partial(kFilmGrid, 0, {0, 2});
  small.sums.pop_back();
  EXPECT_EQ(film.fold(0, 0, small).error().code, Errc::invalid_argument);
  EXPECT_EQ(film, Film(kFilmGrid));
}

TEST(Film, DoesNotDependOnTheOrderOfTiles) {
  std::vector<UnitHeader> units;
  std::vector<std::pair<TileIndex, RoundIndex>> order;
  for (TileIndex t = 0; t < kFilmGrid.count(); ++t)
    for (RoundIndex k = 0; k < round_count(70); ++k) order.emplace_back(t, k);
  const Film expected = make_film(kFilmGrid, 70);

  for (unsigned seed = 0; seed < 5; ++seed) {
    std::shuffle(order.begin(), order.end(), std::mt19937(seed));
    Film film(kFilmGrid);
    auto waiting = order;
    // A round that comes too early is folded later, as in the coordinator.
    while (!waiting.empty())
      std::erase_if(waiting, [&](const auto& unit) {
        return film.fold(unit.first, unit.second, make_round(kFilmGrid, unit.first, unit.second, 70))
            .has_value();
      });
    EXPECT_EQ(film, expected);
    EXPECT_EQ(pixels_sha256(film), pixels_sha256(expected));
    EXPECT_EQ(film.error(), expected.error());
  }
}

TEST(Film, ContinuedJobHasTheBitsOfTheOneShotJob) {
  for (const std::uint64_t spp : {2u, 3u, 6u, 22u, 50u, 64u, 100u, 130u}) {
    Film film = make_film(kFilmGrid, spp);
    for (TileIndex t = 0; t < kFilmGrid.count(); ++t)
      for (RoundIndex k = film.full_rounds(t); k < round_count(2 * spp); ++k)
        ASSERT_TRUE(film.fold(t, k, make_round(kFilmGrid, t, k, 2 * spp)));

    const Film one_shot = make_film(kFilmGrid, 2 * spp);

    EXPECT_EQ(film, one_shot) << spp;
    EXPECT_EQ(pixels_sha256(film), pixels_sha256(one_shot)) << spp;
  }
}

TEST(Film, TruncatedRoundCountsUntilALongerOneReplacesIt) {
  Film film(kFilmGrid);
  ASSERT_TRUE(film.fold(0, 0, make_partial(kFilmGrid, 0, {0, 2})));
  ASSERT_TRUE(film.fold(0, 1, make_partial(kFilmGrid, 0, {2, 4})));
  ASSERT_TRUE(film.fold(0, 2, make_partial(kFilmGrid, 0, {4, 6})));
  const Digest with_cut = film.tile_digest(0);
  EXPECT_EQ(film.spp(0), 6u);
  EXPECT_EQ(film.full_rounds(0), 2u);
  EXPECT_EQ(film.rounds_folded(0), 3u);
  EXPECT_EQ(film.tail(0), (SampleRange{4, 6}));

  EXPECT_EQ(film.fold(0, 2, make_partial(kFilmGrid, 0, {4, 6})).error().code, Errc::already_exists);
  EXPECT_EQ(film.fold(0, 3, make_partial(kFilmGrid, 0, {8, 16})).error().code, Errc::failed_precondition);
  ASSERT_TRUE(film.fold(0, 2, make_partial(kFilmGrid, 0, {4, 8})));

  EXPECT_EQ(film.spp(0), 8u);
  EXPECT_EQ(film.tail(0), std::nullopt);
  EXPECT_NE(film.tile_digest(0), with_cut);
}

TEST(Film, TileDigestIsTheChainOverUnitDigests) {
  Film film(kFilmGrid);
  Digest chain;
  for (RoundIndex k = 0; k < 3; ++k) {
    const Partial partial = make_round(kFilmGrid, 2, k, 6);
    ASSERT_TRUE(film.fold(2, k, partial));
    Sha256 hash;
    hash.update(std::as_bytes(std::span(chain.bytes)));
    const Digest unit = unit_digest(partial);
    hash.update(std::as_bytes(std::span(unit.bytes)));
    chain = hash.finish();
  }

  EXPECT_EQ(film.tile_digest(2), chain);
}

TEST(Film, CopiesAreSnapshots) {
  Film film = make_film(kFilmGrid, 4);
  const Film snapshot = film;
  const Digest pixels = pixels_sha256(snapshot);

  ASSERT_TRUE(film.fold(0, 2, make_partial(kFilmGrid, 0, {4, 8})));
  film.discard(1);

  EXPECT_EQ(pixels_sha256(snapshot), pixels);
  EXPECT_NE(pixels_sha256(film), pixels);
  EXPECT_EQ(film.spp(1), 0u);
}

TEST(FilmBytes, LoadsWhatWasSaved) {
  for (const std::uint64_t spp : {2u, 6u, 10u, 64u, 70u}) {
    Film film = make_film(kFilmGrid, spp);
    film.discard(3);
    Film back(kFilmGrid);

    for (TileIndex t = 0; t < kFilmGrid.count(); ++t) ASSERT_TRUE(back.load_tile(t, film.save_tile(t)));

    EXPECT_EQ(back, film);
    EXPECT_EQ(back.error(), film.error());
  }
}

TEST(FilmBytes, RefusesAnotherTile) {
  const Film film = make_film(kFilmGrid, 10);
  Film back = film;

  EXPECT_FALSE(back.load_tile(0, film.save_tile(1)));
  EXPECT_FALSE(back.load_tile(99, film.save_tile(1)));

  EXPECT_EQ(back, film);
}

TEST(FilmBytes, RefusesTruncationAndDamage) {
  const TileGrid grid{{8, 8}, 8};
  const auto bytes = make_film(grid, 6).save_tile(0);
  Film film(grid);
  for (std::size_t n = 1; n < bytes.size(); n += 7)
    ASSERT_FALSE(film.load_tile(0, std::span(bytes).first(n))) << n;
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    auto bad = bytes;
    bad[i] ^= std::byte{16};
    ASSERT_FALSE(film.load_tile(0, bad)) << i;
  }
}

// Folds the sums of rounds in a wrong order, and returns the digest of the pixels. A film accepts only the
// order 0, 1, 2, ..., so the sums of each round are labelled as the round that the film expects. The finished
// pixels are still correct means, since they are divided by the number of all samples.
Digest folded_in(const std::vector<RoundIndex>& order) {
  const TileGrid grid{{32, 32}, 32};
  static std::map<RoundIndex, Partial> rounds;
  Film film(grid);
  for (RoundIndex at = 0; at < order.size(); ++at) {
    auto& made = rounds[order[at]];
    if (made.sums.empty()) made = fake_partial(make_partial(grid, 0, round_range(order[at])).header);
    Partial partial = made;
    partial.header.samples = round_range(at);
    EXPECT_TRUE(film.fold(0, at, partial));
  }
  return pixels_sha256(film);
}

TEST(FakePixels, RevealTwoRoundsFoldedInReverse) {
  std::vector<RoundIndex> order(kFakeMarkerRounds + 4);  // more than one group of marks (fake_pixels.h)
  std::iota(order.begin(), order.end(), RoundIndex{0});
  const Digest right = folded_in(order);
  for (std::size_t i = 0; i < order.size(); ++i)
    for (std::size_t k = i + 1; k < order.size(); ++k) {
      std::swap(order[i], order[k]);
      if (k > 1) EXPECT_NE(folded_in(order), right) << "rounds " << i << " and " << k;
      // Since a + b = b + a, swapping the first two rounds changes no pixel.
      else
        EXPECT_EQ(folded_in(order), right);
      std::swap(order[i], order[k]);
    }
}

TEST(FakePixels, RevealRoundsFoldedInOrderOfArrival) {
  const Digest right = folded_in({0, 1, 2, 3});
  for (const auto& order :
       std::vector<std::vector<RoundIndex>>{{0, 2, 1, 3}, {0, 1, 3, 2}, {2, 0, 1, 3}, {3, 2, 1, 0}})
    EXPECT_NE(folded_in(order), right) << ::testing::PrintToString(order);
}

}  // namespace
}  // namespace ls
