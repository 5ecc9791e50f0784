// Sums over more samples than a float32 can count.
#include <gtest/gtest.h>

#include <cstring>

#include "core/image/exr/final_image.h"
#include "core/image/film/film.h"
#include "tests/unit/image/support.h"

namespace ls {
namespace {

using test::name_of;

// Returns a film of one pixel whose samples all have this value. The float32 sums of each unit are rounded
// once.
Film alike(double value, RoundIndex rounds) {
  const TileGrid grid{{1, 1}, 1};
  Film film(grid);
  for (RoundIndex k = 0; k < rounds; ++k) {
    const SampleRange samples = round_range(k);
    Partial p{{name_of("scene"), name_of("settings"), name_of("class"), grid.rect(0), samples}, {}};
    p.sums.assign(kPartialChannels, static_cast<float>(value * static_cast<double>(samples.count()) / 2));
    if (!film.fold(0, k, p)) ADD_FAILURE() << "round " << k;
  }
  return film;
}

TEST(Sums, MoreOnesThanFloat32HoldsAddUpExactly) {
  // 64 samples in all but the first few rounds: more than 2^25 together.
  const Film film = alike(1, (1 << 19) + 8);

  EXPECT_GT(film.spp(0), std::uint64_t{1} << 25);
  EXPECT_EQ(film.pixels(0).mean[0], 1);
  EXPECT_EQ(film.pixels(0).standard_error[0], 0) << "equal samples have no variance, not even a negative one";
}

TEST(Sums, TenthsDriftByAtMostTheirRounding) {
  const Film film = alike(.1, 1 << 14);

  // The float32 sum of each unit has the same relative error of at most 2^-24, so the mean has no larger one.
  EXPECT_NEAR(film.pixels(0).mean[0], .1, .1 * 0x1p-24);
}

// Returns a film of one pixel with `samples` samples of value float32(.1), as if its rounds had been folded,
// which would take hours. It replaces the number of rounds and the sums in a saved tile (film_bytes.cpp has
// the format). The sums are those that folding would give: a 24-bit number times a count below 2^29 is exact
// in double at every step.
constexpr std::size_t kRoundsAt = 12, kSumsAt = 192, kChecksum = 32;
Film long_ago(std::uint64_t samples) {
  Film film = alike(.1, 6);
  std::vector<std::byte> bytes = film.save_tile(0);
  const auto rounds = static_cast<RoundIndex>(samples / 64 + 5);
  const double sum = double{.1f} * static_cast<double>(samples / 2);
  std::memcpy(&bytes[kRoundsAt], &rounds, sizeof rounds);
  for (std::size_t i = 0; i < kPartialChannels; ++i) std::memcpy(&bytes[kSumsAt + 8 * i], &sum, sizeof sum);
  bytes.resize(bytes.size() - kChecksum);
  const Digest digest = sha256(std::span<const std::byte>(bytes));
  bytes.insert(bytes.end(), reinterpret_cast<const std::byte*>(digest.bytes.data()),
               reinterpret_cast<const std::byte*>(digest.bytes.data()) + kChecksum);
  const auto loaded = film.load_tile(0, bytes);
  EXPECT_TRUE(loaded) << loaded.error().message;
  return film;
}

void fold_tenths(Film& film, int rounds) {
  for (int i = 0; i < rounds; ++i) {
    const RoundIndex k = film.full_rounds(0);
    Partial p{{name_of("scene"), name_of("settings"), name_of("class"), film.grid().rect(0), round_range(k)},
              {}};
    p.sums.assign(kPartialChannels, .1f * 32);
    ASSERT_TRUE(film.fold(0, k, p));
  }
}

TEST(Sums, BillionTenthsAddUpExactly) {
  constexpr int kMore = 1000;
  Film film = long_ago(1'000'000'000 - 64 * kMore);

  fold_tenths(film, kMore);

  // If the sum stopped growing in these last rounds, as a float32 sum does when it is 2^24 times a round, the
  // mean would be too low by 64 in a million.
  EXPECT_EQ(film.spp(0), 1'000'000'000u);
  EXPECT_NEAR(film.pixels(0).mean[0] / double{.1f}, 1, 1e-12);
  EXPECT_EQ(film.pixels(0).standard_error[0], 0);
}

TEST(Sums, MoreSamplesThanAnIntHoldsKeepTheirCountInTheImage) {
  Film film = long_ago(3'000'000'000);

  fold_tenths(film, 1);

  const auto image = final_exr(film, {}, {.float_output = true});
  ASSERT_TRUE(image) << image.error().message;
  const auto read = read_final_exr(image->exr, "own");
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(std::get<ExrUint>(read->channels.at("spp")).values.at(0), 3'000'000'064u);
  EXPECT_EQ(std::get<ExrFloat>(read->channels.at("R")).values.at(0), .1f);
}

}  // namespace
}  // namespace ls
