#include "common/job/sealed_image.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>
#include <tuple>

#include "common/image/exr_file.h"
#include "tests/unit/image/support.h"

namespace ls {
namespace {

using test::make_film;
using ::testing::HasSubstr;

const TileGrid kGrid{{25, 13}, 8};

RenderSettings settings() {
  RenderSettings s;
  s.size = kGrid.frame;
  s.tile = kGrid.tile;
  s.integrator = "volpath";
  return s;
}

std::vector<std::byte> sealed(const Film& film, bool float_output, const RenderSettings& s = settings()) {
  const Provenance from{test::name_of("scene"), canonical_json(s), "build 1", test::name_of("class"), 7, 1};
  auto image = final_exr(film, from, float_output);
  if (!image) throw std::runtime_error(image.error().message);
  return std::move(image->exr);
}

std::string refusal(const std::vector<std::byte>& exr) {
  const auto image = read_sealed_image(exr, "image.exr");
  return image ? "taken" : image.error().message;
}

// The file with one text for another of the same length.
std::vector<std::byte> changed(std::vector<std::byte> exr, std::string_view from, std::string_view to) {
  std::string text(reinterpret_cast<const char*>(exr.data()), exr.size());
  const auto at = text.find(from);
  if (at == std::string::npos || from.size() != to.size()) throw std::logic_error("not there");
  std::memcpy(exr.data() + at, to.data(), to.size());
  return exr;
}

TEST(SealedImage, GivesBackWhatTheFinalImageHolds) {
  const Film film = make_film(kGrid, 6);

  for (const bool floats : {false, true}) {
    const auto image = read_sealed_image(sealed(film, floats), "image.exr");

    ASSERT_TRUE(image) << image.error().message;
    EXPECT_EQ(image->half, !floats);
    EXPECT_EQ(image->scene, test::name_of("scene"));
    EXPECT_EQ(image->numeric_class, test::name_of("class"));
    EXPECT_EQ(image->settings, settings());
    EXPECT_EQ(image->build, "build 1");
    ASSERT_EQ(image->tiles.size(), kGrid.count());
    for (TileIndex t = 0; t < kGrid.count(); ++t) {
      EXPECT_EQ(image->tiles[t], film.tile_digest(t));
      EXPECT_EQ(tile_samples(*image, t).value(), 6u);
      EXPECT_FALSE(first_difference(*image, film.pixels(t)));
    }
  }
}

TEST(SealedImage, FindsTheFirstPixelThatIsNotOfItsSamples) {
  const Film film = make_film(kGrid, 6);
  auto image = read_sealed_image(sealed(film, false), "image.exr").value();
  const int x = 11, y = 9;  // of tile 5, which begins at 8, 8
  float& green = image.rgb[3 * (y * 25 + x) + 1];
  green = std::nextafter(green, 1e9f);

  const auto found = first_difference(image, film.pixels(5));
  ASSERT_TRUE(found);
  EXPECT_EQ(std::tuple(found->x, found->y, found->what), std::tuple(x, y, "colour"));
  EXPECT_FALSE(first_difference(image, film.pixels(3)));
}

TEST(SealedImage, FindsTheFirstStandardErrorThatIsNotOfItsSamples) {
  const Film film = make_film(kGrid, 6);
  auto image = read_sealed_image(sealed(film, false), "image.exr").value();
  const int x = 12, y = 10;  // of tile 5
  image.error[3 * (y * 25 + x) + 2] /= 2;

  const auto found = first_difference(image, film.pixels(5));
  ASSERT_TRUE(found);
  EXPECT_EQ(std::tuple(found->x, found->y, found->what), std::tuple(x, y, "standard error"));
  EXPECT_FALSE(first_difference(image, film.pixels(3)));
}

TEST(SealedImage, ATileHasOneCountOfSamples) {
  auto image = read_sealed_image(sealed(make_film(kGrid, 6), true), "image.exr").value();
  image.spp[0] = 8;
  image.spp[8] = 7;

  EXPECT_THAT(tile_samples(image, 0).error().message,
              HasSubstr("pixel 0,0 says 8 samples, pixel 1,0 says 6"));
  EXPECT_FALSE(tile_samples(image, 1));
  EXPECT_TRUE(tile_samples(image, 2));
  for (int y = 0; y < 8; ++y)
    for (int x = 8; x < 16; ++x) image.spp[y * 25 + x] = 7;
  EXPECT_THAT(tile_samples(image, 1).error().message, HasSubstr("has 7 samples"));
}

TEST(SealedImage, NamesTheHeaderThatIsWrong) {
  const auto good = sealed(make_film(kGrid, 2), false);
  const std::string scene = test::name_of("scene").hex(), tile = make_film(kGrid, 2).tile_digest(3).hex();

  EXPECT_EQ(refusal(good), "taken");
  EXPECT_THAT(refusal(changed(good, "lightshaft:scene", "lightshaft:scent")),
              HasSubstr("no header \"lightshaft:scene\""));
  EXPECT_THAT(refusal(changed(good, scene, std::string(64, 'x'))),
              HasSubstr("\"lightshaft:scene\" is no SHA-256"));
  EXPECT_THAT(refusal(changed(good, tile, std::string(64, 'x'))), HasSubstr("tile 3 of its header"));
  EXPECT_THAT(refusal(changed(good, "\"tile\":8", "\"tile\":9")), HasSubstr("does not name 6 tiles"));
  EXPECT_THAT(refusal(changed(good, "[25,13]", "[26,13]")),
              HasSubstr("25 x 13 pixels, its settings say 26 x 13"));
}

TEST(SealedImage, OfAPictureOfAnotherProgramSaysWhatIsMissing) {
  ExrPicture other{{2, 2}, {}, {}};
  for (const char* c : {"R", "G", "B"}) other.channels[c] = ExrFloat{std::vector<float>(4, 1.f)};
  EXPECT_THAT(refusal(write_exr(other).value()), HasSubstr("no layer spp"));
  other.channels["spp"] = ExrUint{std::vector<std::uint32_t>(4, 2)};
  EXPECT_THAT(refusal(write_exr(other).value()), HasSubstr("no layer stderr.R"));
  for (const char* c : {"stderr.R", "stderr.G", "stderr.B"})
    other.channels[c] = ExrFloat{std::vector<float>(4)};
  EXPECT_THAT(refusal(write_exr(other).value()), HasSubstr("only images that Lightshaft has finished"));
}

TEST(SealedImage, CutShortAnywhereIsRefusedAndNothingElse) {
  const auto good = sealed(make_film(kGrid, 2), false);
  for (std::size_t n = 0; n < good.size(); n += 1 + good.size() / 97)
    EXPECT_FALSE(read_sealed_image(std::span(good).first(n), "image.exr")) << n;
}

}  // namespace
}  // namespace ls
