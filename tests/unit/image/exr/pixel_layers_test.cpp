#include "core/image/exr/pixel_layers.h"
#include "core/image/frame/frame.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "core/image/exr/final_image.h"
#include "tests/unit/image/support.h"
#include "worker/fake/fake_pixels.h"

namespace ls {
namespace {

// 3 x 2 tiles. The tiles of the right column and of the lower row are smaller.
constexpr TileGrid kLayerGrid{{83, 45}, 32};
constexpr PixelRect kLayerWhole{0, 0, 83, 45};

std::vector<float> layer_values(const Film& film, const char* layer, int level, const PixelRect& rect) {
  const PixelLayer found = pixel_layer(film.aovs(), layer).value();
  LayerMosaic mosaic(found, kLayerGrid.frame, level, rect);
  for (const TileIndex tile : tiles_over(kLayerGrid, rect_in_image(kLayerGrid.frame, level, rect))) {
    const TileLayers tiles(film, tile, found.aov.has_value());
    mosaic.add(0, tiles.rect(), tiles.values(found));
  }
  return layer_floats(found, mosaic.bytes());
}

TEST(PixelLayers, ImageLayersAreMeansAndErrorsInHalfFloats) {
  const Film film = test::make_film(kLayerGrid, 32);

  const auto rgb = layer_values(film, "rgb", 0, kLayerWhole),
             error = layer_values(film, "stderr", 0, kLayerWhole);

  for (TileIndex t = 0; t < kLayerGrid.count(); ++t) {
    const TilePixels tile = film.pixels(t);
    std::size_t from = 0;
    for (int y = tile.rect.y0; y < tile.rect.y1; ++y)
      for (int x = 3 * tile.rect.x0; x < 3 * tile.rect.x1; ++x, ++from) {
        const auto at = static_cast<std::size_t>(y * 3 * kLayerGrid.frame.width + x);
        ASSERT_EQ(rgb[at], as_half(static_cast<float>(tile.mean[from])));
        ASSERT_EQ(error[at], as_half(static_cast<float>(tile.standard_error[from])));
      }
  }
}

TEST(PixelLayers, PartEqualsThatPartOfTheWhole) {
  const Film film = test::make_film(kLayerGrid, 16);
  for (const int level : {0, 1, 3}) {
    const FrameSize size = level_size(kLayerGrid.frame, level);
    const PixelRect part{size.width / 4, 1, size.width, size.height - 1};

    const auto whole = layer_values(film, "rgb", level, {0, 0, size.width, size.height});
    const auto found = layer_values(film, "rgb", level, part);

    std::size_t at = 0;
    for (int y = part.y0; y < part.y1; ++y)
      for (int x = 3 * part.x0; x < 3 * part.x1; ++x, ++at)
        ASSERT_EQ(found[at], whole[static_cast<std::size_t>(y * 3 * size.width + x)]);
  }
}

TEST(PixelLayers, EdgeBlockHasTheMeanOfItsOwnPixels) {
  const Film film = test::make_film(kLayerGrid, 16);
  const TilePixels corner = film.pixels(kLayerGrid.count() - 1);  // 19 x 13 pixels, from (64, 32)
  double mean = 0, squares = 0;
  for (std::size_t y = 8; y < 13; ++y)  // the last block of level 3 has 3 x 5 pixels
    for (std::size_t x = 16; x < 19; ++x) {
      mean += corner.mean[3 * (y * 19 + x)] / 15;
      squares += std::pow(corner.standard_error[3 * (y * 19 + x)] / 15, 2);
    }

  const PixelRect last{10, 5, 11, 6};

  EXPECT_EQ(layer_values(film, "rgb", 3, last)[0], as_half(static_cast<float>(mean)));
  EXPECT_EQ(layer_values(film, "stderr", 3, last)[0], as_half(static_cast<float>(std::sqrt(squares))));
}

TEST(PixelLayers, PixelsWithoutSamplesAreNanAndDoNotCountInBlocks) {
  Film film(kLayerGrid);
  ASSERT_TRUE(film.fold(0, 0, test::make_round(kLayerGrid, 0, 0, 16)));

  const auto level0 = layer_values(film, "rgb", 0, {31, 0, 33, 1});
  const auto level10 = layer_values(film, "spp", 10, {0, 0, 1, 1});

  EXPECT_FALSE(std::isnan(level0[0]));
  EXPECT_TRUE(std::isnan(level0[3]));
  EXPECT_EQ(level10[0], static_cast<float>(film.spp(0))) << "the mean of the pixels that have samples";
}

TEST(PixelLayers, AovLayersAreNamedAsInTheExr) {
  const AovSet aovs = AovSet().with(Aov::depth).with(Aov::shape_id).with(Aov::denoising_albedo);
  Film film(kLayerGrid, aovs);
  const UnitHeader header{test::name_of("s"), test::name_of("t"), test::name_of("c"), kLayerGrid.rect(0),
                          cut_range(0, 16)};
  ASSERT_TRUE(film.fold(0, 0, fake_partial(header, aovs)));
  ExrPicture exr{kLayerGrid.frame, {}, {}};
  add_aov_layers(film, {}, {}, exr);
  const auto channel = [&](const char* name) {
    const auto& planes = exr.channels.at(name);
    if (const auto* half = std::get_if<ExrHalf>(&planes)) return half->values;
    return std::get<ExrFloat>(planes).values;
  };

  const auto depth = layer_values(film, "depth", 0, {5, 7, 6, 8}),
             id = layer_values(film, "crypto_object", 0, {5, 7, 6, 8}),
             guide = layer_values(film, "denoising_albedo", 0, {5, 7, 6, 8});

  const std::size_t at = 7 * 83 + 5;
  EXPECT_EQ(depth[0], as_half(channel("depth.Z")[at]));
  EXPECT_EQ(guide[1], as_half(channel("denoising_albedo.G")[at]));
  EXPECT_EQ(id[0], channel("crypto_object00.R")[at]);
  EXPECT_EQ(id[1], channel("crypto_object00.G")[at]);
  EXPECT_EQ(id[4], channel("crypto_object01.R")[at]);
  EXPECT_FALSE(pixel_layer(aovs, "albedo")) << "the job did not ask for it";
}

TEST(PixelLayers, LightGroupsHaveMeansAndHalfDifferences) {
  const AovSet aovs = AovSet().with(Aov::light_groups).with(Aov::volume_light_groups).with_groups(2);
  const std::vector<std::string> groups = {"fill", "key"};
  Film film(kLayerGrid, aovs);
  const UnitHeader header{test::name_of("s"), test::name_of("t"), test::name_of("c"), kLayerGrid.rect(0),
                          cut_range(0, 16)};
  Partial partial = fake_partial(header, aovs);
  for (std::size_t i = 0; i < partial.sums.size(); ++i)
    partial.sums[i] += static_cast<float>(i % 1009);  // planes that differ, also between the halves
  ASSERT_TRUE(film.fold(0, 0, partial));
  const auto spp = static_cast<double>(film.spp(0));
  ExrPicture exr{kLayerGrid.frame, {}, {}};
  add_aov_layers(film, {.light_groups = groups}, {.float_output = true}, exr);
  std::vector<std::string> names;
  for (const PixelLayer& layer : pixel_layers(aovs, groups)) names.push_back(layer.name);
  EXPECT_THAT(names, testing::ElementsAre("rgb", "stderr", "error", "spp", "RGB_fill", "RGB_fill.delta",
                                          "RGB_key", "RGB_key.delta", "RGB_fill.volume",
                                          "RGB_fill.volume.delta", "RGB_key.volume", "RGB_key.volume.delta"));

  const AovPlanes planes = planes_of(aovs);
  const auto rect = kLayerGrid.rect(0);
  const auto pixels = static_cast<std::size_t>(rect.pixels()), at = std::size_t{3};
  const auto sum = [&](const std::string& plane) {
    const auto index = std::ranges::find(planes.names, plane) - planes.names.begin();
    return double{partial.sums[(6 + static_cast<std::size_t>(index)) * pixels + at]};
  };
  for (const auto& [layer, plane] : std::map<std::string, std::string>{
           {"RGB_key", "aov.light_groups.01"}, {"RGB_fill.volume", "aov.volume_light_groups.00"}}) {
    const double a = sum(plane + ".A.G"), b = sum(plane + ".B.G");
    const auto value = [&](const std::string& name) {
      return std::get<ExrFloat>(exr.channels.at(name + ".G")).values[at];  // in the first row of the image
    };
    const auto shown = [&](const std::string& name) {
      const PixelLayer found = pixel_layer(aovs, name, groups).value();
      return TileLayers(film, 0, true).values(found)[3 * at + 1];
    };
    EXPECT_EQ(value(layer), static_cast<float>((a + b) / spp));
    EXPECT_EQ(value(layer + ".delta"), static_cast<float>((a - b) / spp));
    EXPECT_EQ(shown(layer), value(layer));
    EXPECT_EQ(shown(layer + ".delta"), value(layer + ".delta"));
    EXPECT_NE(a, b) << "the test needs halves that differ";
  }
  ExrPicture unnamed{kLayerGrid.frame, {}, {}};
  add_aov_layers(film, {}, {.float_output = true}, unnamed);
  EXPECT_TRUE(unnamed.channels.contains("RGB_1.delta.B")) << "groups without names have numbers";
}

TEST(PixelLayers, RequestIsBounded) {
  constexpr FrameSize k4K{3840, 2160};
  EXPECT_TRUE(check_layer_rect(k4K, 0, {3328, 1648, 3840, 2160}));
  EXPECT_TRUE(check_layer_rect(k4K, 1, {0, 0, 512, 512}));
  EXPECT_TRUE(check_layer_rect(k4K, 10, {3, 2, 4, 3}));
  for (const auto& [level, rect] : std::vector<std::pair<int, PixelRect>>{{0, {0, 0, 513, 1}},
                                                                          {0, {0, 0, 0, 1}},
                                                                          {0, {3839, 0, 3841, 1}},
                                                                          {0, {-1, 0, 1, 1}},
                                                                          {1, {1900, 0, 1921, 1}},
                                                                          {2, {0, 0, 257, 256}},
                                                                          {10, {0, 0, 2, 1}},
                                                                          {11, {0, 0, 1, 1}},
                                                                          {-1, {0, 0, 1, 1}}})
    EXPECT_FALSE(check_layer_rect(k4K, level, rect)) << level << " " << show(rect);
}

}  // namespace
}  // namespace ls
