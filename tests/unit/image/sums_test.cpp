// Sums over more samples than float32 can count (STABILITY N49, N50, N55).
#include <gtest/gtest.h>

#include "common/image/film.h"
#include "tests/unit/image/support.h"

namespace ls {
namespace {

using test::name_of;

// A film of one pixel, all of whose samples are `value`: units of float32 sums, rounded once.
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

TEST(Sums, OfMoreOnesThanFloat32CountsAreExact) {
  const Film film = alike(1, (1 << 19) + 8);  // 64 samples in all but the first few: beyond 2^25

  EXPECT_GT(film.spp(0), std::uint64_t{1} << 25);
  EXPECT_EQ(film.pixels(0).mean[0], 1);
  EXPECT_EQ(film.pixels(0).standard_error[0], 0) << "equal samples have no variance, not even a negative one";
}

TEST(Sums, OfTenthsDriftByNoMoreThanTheirRounding) {
  const Film film = alike(.1, 1 << 14);

  // Each unit's sum is a float32, off by the same share of at most 2^-24: the mean is off by that, not more.
  EXPECT_NEAR(film.pixels(0).mean[0], .1, .1 * 0x1p-24);
}

}  // namespace
}  // namespace ls
