#include "core/image/reference/reference.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "core/image/error/error_estimate.h"
#include "core/image/exr/final_image.h"
#include "tests/support/significance.h"
#include "tests/unit/image/support.h"

namespace ls {
namespace {

using ::testing::HasSubstr;

constexpr FrameSize kSize{16, 12};
constexpr double kRounding = 576 * 0x1p-53;  // rounding error of a sum of kReferenceValues values below 1
constexpr std::size_t kReferenceValues = std::size_t{3} * 16 * 12;

ExrPicture picture(float level) {
  ExrPicture p{kSize, {}, {}};
  for (const char* c : {"R", "G", "B"})
    p.channels[c] = ExrFloat{std::vector<float>(kReferenceValues / 3, level)};
  return p;
}

ExrPicture with_error(ExrPicture p, float error) {
  for (const char* c : {"stderr.R", "stderr.G", "stderr.B"})
    p.channels[c] = ExrFloat{std::vector<float>(kReferenceValues / 3, error)};
  return p;
}

Result<Reference> read(const ExrPicture& p, FrameSize size = kSize) {
  return read_reference(write_exr(p).value(), "right.exr", size);
}

TEST(Reference, ReferenceWithoutErrorLayersGivesThePlainDifference) {
  const auto reference = read(picture(2));
  ASSERT_TRUE(reference) << reference.error().message;

  const TrueError e = true_error(*reference, std::vector<float>(kReferenceValues, 2.5F));

  EXPECT_TRUE(reference->error.empty());
  EXPECT_DOUBLE_EQ(e.rmse, .5);
  EXPECT_NEAR(e.relmse, .25 / 4.01, kRounding);
  EXPECT_EQ(noise_of(*reference).relmse, 0);
}

TEST(Reference, SubtractsItsOwnError) {
  const auto reference = read(with_error(picture(2), .25F));
  ASSERT_TRUE(reference);

  const TrueError e = true_error(*reference, std::vector<float>(kReferenceValues, 2.5F));

  EXPECT_DOUBLE_EQ(e.rmse, std::sqrt(.25 - .0625));
  // The halves are 2.25 and 1.75, each with the variance 2 s^2.
  const double h = (relative_weight(2.25, .125) + relative_weight(1.75, .125)) / 2;
  EXPECT_NEAR(e.relmse, (.25 - .0625) * h, kRounding);
  EXPECT_DOUBLE_EQ(noise_of(*reference).mse, .0625);
  EXPECT_NEAR(noise_of(*reference).relmse, .0625 * h, kRounding);
  // .01 - .0625 is negative and becomes 0.
  EXPECT_EQ(true_error(*reference, std::vector<float>(kReferenceValues, 2.1F)).rmse, 0);
}

// The reference has an eighth of the image's squared error, .005, so a ninth of the squared difference is its
// own. With its error layers, made of two halves as in our images, the squared error of the image alone is
// found. The mean over 2000 images would be known to 1 / sqrt(2000 * 576 / 2) = .13 % from the image's noise
// alone, but subtracting the reference's noise adds to this, so the tolerance is computed from the measured
// standard error.
TEST(Reference, IsUnbiasedForTheImagesError) {
  std::mt19937_64 random(7);
  std::normal_distribution<float> normal;
  double sum = 0, squares = 0, raw = 0;
  constexpr int kTrials = 2000;
  for (int i = 0; i < kTrials; ++i) {
    Reference reference{kSize, {}, {}};
    std::vector<float> image;
    for (std::size_t v = 0; v < kReferenceValues; ++v) {
      // Two halves: their mean has the variance .005.
      const float a = 1 + .1F * normal(random), b = 1 + .1F * normal(random);
      reference.rgb.push_back((a + b) / 2);
      reference.error.push_back(std::abs(a - b) / 2);
      image.push_back(1 + .2F * normal(random));  // variance .04
    }
    const double mse = std::pow(true_error(reference, image).rmse, 2);
    sum += mse, squares += mse * mse;
    reference.error.clear();
    raw += std::pow(true_error(reference, image).rmse, 2);
  }
  const double mean = sum / kTrials, sigma = std::sqrt((squares / kTrials - mean * mean) / kTrials);
  EXPECT_LT(std::abs(mean - .04), test::kStandardErrors * sigma);
  EXPECT_LT(sigma, .0001);  // otherwise the tolerance above would test nothing
  EXPECT_GT(raw / kTrials,
            .045 - test::kStandardErrors * sigma);  // without the error layers the reference's noise remains
}

TEST(Reference, RefusesUnusableFiles) {
  ExrPicture nan = picture(1);
  std::get<ExrFloat>(nan.channels["G"]).values[5] = std::nanf("");
  EXPECT_THAT(read(nan).error().message, HasSubstr("1 of its values are NaN or infinite"));
  EXPECT_THAT(read(with_error(picture(1), -1)).error().message, HasSubstr("no standard errors"));
  EXPECT_THAT(read(picture(1), {20, 12}).error().message, HasSubstr("16 x 12"));
  EXPECT_THAT(read_reference({}, "right.exr", kSize).error().message, HasSubstr("right.exr"));
}

TEST(Reference, ReadsAFinalImageWithItsErrorLayers) {
  const Film film = test::make_film({kSize, 8}, 8);
  for (const ExrParts parts : exr_parts()) {
    const auto exr = final_exr(film, {}, {.float_output = true, .parts = parts});
    ASSERT_TRUE(exr);

    const auto reference = read_reference(exr->exr, "ours", kSize);

    ASSERT_TRUE(reference) << reference.error().message;
    ASSERT_EQ(reference->error.size(), kReferenceValues);
    const TilePixels tile = film.pixels(0);
    EXPECT_EQ(reference->error[3], static_cast<float>(tile.standard_error[3]));
    EXPECT_EQ(reference->rgb[4], static_cast<float>(tile.mean[4]));
  }
}

TEST(Reference, RefusesAnImageOfAnotherColourSpace) {
  const auto exr = final_exr(test::make_film({kSize, 8}, 8), {}, {.colour_space = ColourSpace::rec2020});
  EXPECT_THAT(read_reference(exr->exr, "wide.exr", kSize).error().message,
              HasSubstr("wide.exr: its colours are not those of Rec. 709"));
}

// ---- maps ----

TEST(Maps, ColoursRiseInLightness) {
  double before = -1;
  for (int i = 0; i <= 100; ++i) {
    const auto c = map_colour(i / 100.);
    const double light = .2126 * std::pow(c[0] / 255., 2.2) + .7152 * std::pow(c[1] / 255., 2.2) +
                         .0722 * std::pow(c[2] / 255., 2.2);
    EXPECT_GT(light, before) << i;
    before = light;
  }
  EXPECT_EQ(map_colour(-1), map_colour(0));
  EXPECT_EQ(map_colour(2), map_colour(1));
  EXPECT_EQ(map_colour(std::nan("")), map_colour(1));
}

TEST(Maps, HaveTheSizeOfTheImage) {
  Film film(TileGrid{kSize, 8});
  ASSERT_TRUE(film.fold(0, 0, test::make_round(film.grid(), 0, 0, 2)));  // the other tiles have no samples
  for (const auto& png : {error_map_png(film), samples_map_png(film)}) {
    ASSERT_TRUE(png);
    ASSERT_GT(png->size(), 24u);
    EXPECT_EQ(std::to_integer<int>((*png)[19]),
              kSize.width);  // width and height in the chunk IHDR, big endian
    EXPECT_EQ(std::to_integer<int>((*png)[23]), kSize.height);
  }
}

}  // namespace
}  // namespace ls
