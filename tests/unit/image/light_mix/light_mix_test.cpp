// Mixes of light groups: their colour, and how far their error figures can be trusted.
#include "core/image/light_mix/light_mix.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "core/image/exr/final_image.h"
#include "tests/unit/image/support.h"

namespace ls {
namespace {

using testing::HasSubstr;

const std::vector<std::string> kGroups = {"calm", "rare"};
const TileGrid kMixGrid{{32, 32}, 32};
constexpr std::uint64_t kSpp = 64;

AovSet groups_of_both() { return AovSet{}.with(Aov::light_groups).with_groups(kGroups.size()); }

// Returns a film of two groups with skewed noise. With `firefly`, the last round of the group "rare" has a
// sample in one pixel that is far brighter than all others. With `faint`, the light of that group is faint,
// and some pixels have it in one half of the samples only.
Film two_groups(bool firefly, bool faint = false) {
  Film film(kMixGrid, groups_of_both());
  std::mt19937_64 random(7);
  std::exponential_distribution<double> light(1);
  const AovPlanes planes = planes_of(film.aovs());
  const std::size_t pixels = kMixGrid.frame.pixels();
  for (RoundIndex k = 0; k < round_count(kSpp); ++k) {
    const SampleRange samples = cut_range(k, kSpp);
    Partial p{{test::name_of("s"), test::name_of("t"), test::name_of("c"), kMixGrid.rect(0), samples},
              std::vector<float>((kPartialChannels + planes.count()) * pixels),
              film.aovs()};
    for (std::size_t i = 0; i < planes.sums.size(); ++i) {
      const AovPlane& plane = planes.sums[i];
      const auto colour = static_cast<std::size_t>(3 * plane.half + plane.component) * pixels;
      for (std::size_t pixel = 0; pixel < pixels; ++pixel) {
        double sum = 0;
        for (std::uint64_t n = 0; n < samples.count() / 2; ++n) sum += light(random);
        if (firefly && plane.group == 1 && plane.half == 0 && pixel == 400 && k + 1 == round_count(kSpp))
          sum += 1e5;
        if (faint && plane.group == 1) sum *= pixel % 8 == 0 ? 1e-2 * static_cast<double>(plane.half) : 1e-6;
        p.sums[(kPartialChannels + i) * pixels + pixel] = static_cast<float>(sum);
        p.sums[colour + pixel] += static_cast<float>(sum);
      }
    }
    EXPECT_TRUE(film.fold(0, k, p));
  }
  return film;
}

std::vector<GroupFactors> factors(double calm, double rare) {
  return {{{calm, calm, calm}, {calm, calm, calm}}, {{rare, rare, rare}, {rare, rare, rare}}};
}
ImageError mixed_error(const Film& film, double calm, double rare) {
  MixedError sum;
  sum.mix(film, factors(calm, rare));
  return sum.error();
}

TEST(MixedError, OfUnchangedGroupsIsThatOfTheColour) {
  const Film film = two_groups(false);
  const ImageError colour = image_error(film.error()), mixed = mixed_error(film, 1, 1);
  ASSERT_TRUE(colour.trusted) << colour.verdict;
  // The sums of two float32 values per pixel, in double and in float32, differ by a relative 2^-24; squares
  // of differences that are at least 1/10 of the values by 2 * 10 times that.
  constexpr double kClose = 20 * 0x1p-24;
  EXPECT_NEAR(mixed.relmse / colour.relmse, 1, kClose);
  EXPECT_LE(mixed.relmse_lo, colour.relmse_lo * (1 + kClose));
  EXPECT_GE(mixed.relmse_hi, colour.relmse_hi * (1 - kClose));
  EXPECT_NEAR(mixed.rmse / colour.rmse, 1, kClose);
}

TEST(MixedError, IsNotCorrectedByAColourThatIsNotTrusted) {
  const Film film = two_groups(true);
  ASSERT_FALSE(image_error(film.error()).trusted);
  const TileError calm = film.mixed(factors(1, 0)).error();

  const ImageError mixed = mixed_error(film, 1, 0), alone = image_error(calm);

  ASSERT_TRUE(alone.trusted) << alone.verdict;
  EXPECT_EQ(mixed.relmse, alone.relmse) << "the firefly is in the other group";
  EXPECT_TRUE(mixed.trusted);
}

// All light of the group "rare" is in one half of the samples: whatever is trusted of it, its RMSE is not
// known.
TEST(MixedError, LeavesAnUnknownIntervalUnknown) {
  const Film film = two_groups(false, true);
  const ImageError alone = image_error(film.mixed(factors(0, 1)).error()), mixed = mixed_error(film, 0, 1);
  ASSERT_GT(image_error(film.error()).rmse_hi, 0);
  ASSERT_EQ(alone.rmse_hi, 0);
  ASSERT_GT(alone.rmse, 0);

  EXPECT_EQ(mixed.rmse_lo, 0);
  EXPECT_EQ(mixed.rmse_hi, 0);
}

TEST(MixedError, OfAnImageWithoutSamplesIsNotWritten) {
  const Film film(kMixGrid, groups_of_both());
  const Film mixed = film.mixed(factors(2, 1));
  Provenance provenance;
  provenance.error_of_mix = mixed_error(film, 2, 1);

  const auto strings = read_final_exr(final_exr(mixed, provenance, {})->exr, "mix").value().strings;

  EXPECT_FALSE(strings.contains("lightshaft:relmse"));
  EXPECT_TRUE(strings.contains("lightshaft:pixels_without_samples"));
  EXPECT_FALSE(strings.contains("lightshaft:tiles")) << "a mix cannot be verified";
}

TEST(LightMixFactors, AreThoseOfTheImagesGroups) {
  const auto error = [](const char* mix, AovSet aovs) {
    const auto found = factors_of(parse_light_mix(mix).value(), aovs, kGroups);
    return found ? "" : found.error().message;
  };
  const AovSet whole = groups_of_both();
  EXPECT_EQ(error("calm=2", whole), "");
  EXPECT_EQ(error("", whole), "");
  EXPECT_THAT(error("other=2", whole), HasSubstr("no light group \"other\"; it has calm, rare"));
  EXPECT_THAT(error("calm.volume=2", whole), HasSubstr("--aov volume_light_groups"));
  EXPECT_EQ(error("calm.volume=2", whole.with(Aov::volume_light_groups)), "");
  EXPECT_THAT(error("", AovSet{}), HasSubstr("the image has no light groups"));
  // The shadows in alpha are those of the lights that are not mixed.
  const AovSet caught = whole.with(Aov::shadow_catcher);
  EXPECT_THAT(error("calm=2", caught.with(Aov::alpha)), HasSubstr("lightshaft again ID --mix"));
  EXPECT_EQ(error("", caught.with(Aov::alpha)), "");
  EXPECT_EQ(error("calm=2", caught), "");
}

}  // namespace
}  // namespace ls
