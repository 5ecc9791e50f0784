#include "coordinator/assemble/stored_layers.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/unit/store/temp_folder.h"
#include "worker/fake/fake_pixels.h"

namespace ls::coordinator {
namespace {

constexpr TileGrid kStoredGrid{{75, 50}, 32};
constexpr AovSet kStoredAovs = AovSet().with(Aov::position).with(Aov::material_id);
constexpr PixelRect kStoredWhole{0, 0, 75, 50};

// A film in which all tiles except this one have samples.
Film film_without(TileIndex empty) {
  Film film(kStoredGrid, kStoredAovs);
  for (TileIndex t = 0; t < kStoredGrid.count(); ++t)
    if (t != empty)
      EXPECT_TRUE(film.fold(t, 0,
                            fake_partial({sha256("scene"), sha256("settings"), sha256("class"),
                                          kStoredGrid.rect(t), cut_range(0, 16)},
                                         kStoredAovs)));
  return film;
}

class StoredLayersTest : public ::testing::Test {
 protected:
  StoredLayersTest() { keep(); }
  void keep() const {
    auto file = SnapshotFile::create(path, ".new", kStoredGrid, kStoredAovs, "f").value();
    const RoundErrors errors(kStoredGrid.count(), false);
    for (TileIndex t = 0; t < kStoredGrid.count(); ++t)
      EXPECT_TRUE(file.add(snapshot_of(rendered, errors, HealthTable(), t)));
    EXPECT_TRUE(file.finish() && file.commit());
  }
  std::shared_ptr<StoredLayers> open() const {
    auto tiles = SnapshotTiles::open(path, kStoredGrid, kStoredAovs, "f");
    return tiles ? std::make_shared<StoredLayers>(std::move(*tiles), kStoredGrid, kStoredAovs) : nullptr;
  }
  std::vector<std::byte> from_memory(const PixelLayer& layer, int level, const PixelRect& rect) const {
    LayerMosaic mosaic(layer, kStoredGrid.frame, level, rect);
    for (TileIndex t = 0; t < kStoredGrid.count(); ++t) {
      const TileLayers tile(rendered, t, true);
      mosaic.add(0, tile.rect(), tile.values(layer));
    }
    return mosaic.bytes();
  }

  const TempFolder folder;
  const std::filesystem::path path = folder.path() / "film.snap";
  Film rendered = film_without(1);
};

TEST_F(StoredLayersTest, MatchTheFilmInMemory) {
  const auto stored = open();
  ASSERT_TRUE(stored);
  for (const PixelLayer& layer : pixel_layers(kStoredAovs))
    for (const int level : {0, 1, 2}) {
      const PixelRect rect{0, 0, level_size(kStoredGrid.frame, level).width,
                           level_size(kStoredGrid.frame, level).height};
      EXPECT_EQ(stored->pixels(layer, level, rect).value(), from_memory(layer, level, rect))
          << layer.name << " level " << level;
    }
}

TEST_F(StoredLayersTest, HighLevelsDifferByAtMostARoundingToHalf) {
  const auto stored = open();
  ASSERT_TRUE(stored);
  const PixelLayer rgb = pixel_layer(kStoredAovs, "rgb").value();
  const PixelRect rect{0, 0, level_size(kStoredGrid.frame, 4).width, level_size(kStoredGrid.frame, 4).height};

  const auto found = layer_floats(rgb, stored->pixels(rgb, 4, rect).value());
  const auto wanted = layer_floats(rgb, from_memory(rgb, 4, rect));

  for (std::size_t i = 0; i < found.size(); ++i) {
    ASSERT_EQ(std::isnan(found[i]), std::isnan(wanted[i]));
    // Half floats have 11 significant bits: each averaged value is off by up to 2^-11 of itself, and so is
    // each of the two results.
    if (!std::isnan(found[i])) EXPECT_NEAR(found[i], wanted[i], 3 * std::ldexp(wanted[i], -11));
  }
}

TEST_F(StoredLayersTest, EmptyTileHidesNoIdentifiersOfItsNeighbours) {
  rendered = film_without(0);
  keep();
  const auto stored = open();
  ASSERT_TRUE(stored);
  const PixelLayer ids = pixel_layer(kStoredAovs, "crypto_material").value();
  for (const int level : {5, 6, 7}) {
    const FrameSize size = level_size(kStoredGrid.frame, level);
    const PixelRect rect{0, 0, size.width, size.height};

    const auto found = stored->pixels(ids, level, rect).value();

    EXPECT_EQ(found, from_memory(ids, level, rect)) << level;
    // A pixel of level 5 is one tile, and the first tile has no samples.
    EXPECT_EQ(layer_floats(ids, found)[0] != 0, level > 5) << level;
  }
}

TEST_F(StoredLayersTest, AreReadOnceForAllLayersOfASmallVersion) {
  const auto stored = open();
  ASSERT_TRUE(stored);
  const PixelRect rect{0, 0, 19, 13};
  const auto layers = pixel_layers(kStoredAovs);
  ASSERT_TRUE(stored->pixels(layers[0], 2, rect));
  const std::size_t kept = stored->bytes();

  std::filesystem::resize_file(path, 100);  // another read of the file would fail

  EXPECT_GT(kept, 0u);
  for (const PixelLayer& layer : layers) EXPECT_TRUE(stored->pixels(layer, 2, rect)) << layer.name;
  EXPECT_EQ(stored->bytes(), kept);
  EXPECT_FALSE(stored->pixels(layers[0], 0, kStoredWhole));
}

TEST_F(StoredLayersTest, AnotherJobsOrDamagedFileIsRefused) {
  EXPECT_FALSE(SnapshotTiles::open(path, {{75, 51}, 32}, kStoredAovs, "f"));
  EXPECT_FALSE(SnapshotTiles::open(path, kStoredGrid, {}, "f"));
  EXPECT_FALSE(SnapshotTiles::open(path, kStoredGrid, kStoredAovs, "g"));
  EXPECT_FALSE(SnapshotTiles::open(folder.path() / "none", kStoredGrid, kStoredAovs, "f"));
  const auto whole = std::filesystem::file_size(path);
  for (const std::uint64_t length : {whole / 2, std::uint64_t{9}, std::uint64_t{0}}) {
    std::filesystem::resize_file(path, length);
    EXPECT_FALSE(SnapshotTiles::open(path, kStoredGrid, kStoredAovs, "f")) << length;
  }
}

TEST_F(StoredLayersTest, ImagesAreKeptUntilOthersTakeTheirPlace) {
  StoredImages images;
  const auto opened = [&] { return open(); };
  const auto first = images.image("first", opened);

  EXPECT_EQ(images.image("first", [] { return std::shared_ptr<StoredLayers>(); }), first);
  for (std::size_t i = 0; i < StoredImages::kMostImages; ++i) images.image(std::to_string(i), opened);

  EXPECT_EQ(images.image("first", [] { return std::shared_ptr<StoredLayers>(); }), nullptr);
}

}  // namespace
}  // namespace ls::coordinator
