// Slots of identifiers; names and headers of Cryptomatte; its layers in the final image.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <bit>
#include <random>

#include "core/image/aov/identifiers.h"
#include "core/image/exr/final_image.h"
#include "tests/unit/image/support.h"
#include "worker/fake/fake_pixels.h"

namespace ls::test {
namespace {

using testing::HasSubstr;

IdSlots seen(std::vector<IdSlot> slots) { return ranked(std::move(slots)); }

TEST(IdSlots, AreRankedByCountThenByIdentifier) {
  const IdSlots slots = seen({{3, 1}, {5, 7}, {2, 1}});

  EXPECT_EQ(slots.slots[0], (IdSlot{5, 7}));
  EXPECT_EQ(slots.slots[1], (IdSlot{2, 1}));
  EXPECT_EQ(slots.slots[2], (IdSlot{3, 1}));
  EXPECT_EQ(slots.slots[3], IdSlot{});
  EXPECT_EQ(wrong_with(slots, 9), "");
}

TEST(IdSlots, AddExactlyInAnyOrderWhileTheySuffice) {
  std::mt19937 random(7);
  std::vector<IdSlots> units;
  for (int i = 0; i < 20; ++i) {
    std::vector<IdSlot> one;
    for (int id = 1; id <= kIdSlots; ++id)
      if (random() % 2) one.push_back({static_cast<float>(id), static_cast<float>(1 + random() % 9)});
    units.push_back(seen(one));
  }
  const auto sum = [&] {
    IdSlots all;
    for (const IdSlots& u : units) all = all + u;
    return all;
  };
  const IdSlots first = sum();

  for (int i = 0; i < 10; ++i) {
    std::shuffle(units.begin(), units.end(), random);
    EXPECT_EQ(sum(), first);
  }
  EXPECT_EQ(first.more, 0);
}

TEST(IdSlots, OverflowKeepsTheLargestAndCountsTheRest) {
  std::vector<IdSlot> many;
  for (int id = 1; id <= kIdSlots + 3; ++id) many.push_back({static_cast<float>(id), static_cast<float>(id)});

  const IdSlots slots = seen(many) + seen({{1, 100}});

  // Of the 101 samples of object 1, the first one found no slot and is among the uncounted.
  EXPECT_EQ(slots.slots[0], (IdSlot{1, 100}));
  EXPECT_EQ(slots.slots[1], (IdSlot{kIdSlots + 3, kIdSlots + 3}));
  EXPECT_EQ(slots.more, 1 + 2 + 3 + 4);
  EXPECT_EQ(wrong_with(slots, 166), "");
  EXPECT_NE(wrong_with(slots, 165), "");
}

TEST(IdSlots, RoundTripThroughPlanes) {
  const IdSlots slots = seen({{3, 1}, {5, 7}});
  std::vector<float> planes(kIdPlanes * 4, -1);

  store_slots(slots, &planes[2], 4);

  EXPECT_EQ(load_slots(&planes[2], 4), slots);
  EXPECT_EQ(std::count(planes.begin(), planes.end(), -1.f), 3 * static_cast<long>(kIdPlanes));
}

// The expected values are those of the reference implementation (SMHasher) with seed 0.
TEST(Cryptomatte, HashesAsMurmurHash3Does) {
  EXPECT_EQ(murmur3_32(""), 0u);
  EXPECT_EQ(murmur3_32("hello"), 0x248bfa47u);
  EXPECT_EQ(murmur3_32("hello, world"), 0x149bbb7fu);
  EXPECT_EQ(murmur3_32("The quick brown fox jumps over the lazy dog"), 0x2e4ff723u);
}

// The example in the specification: a layer "crypto_object" with two names.
TEST(Cryptomatte, WritesTheHeaderOfTheSpecificationsExample) {
  const std::string manifest = cryptomatte_manifest({"default", "bunny", "bunny"});

  EXPECT_EQ(manifest, R"({"bunny":"13851a76","default":"42c9679f"})");
  EXPECT_EQ(cryptomatte_header("crypto_object", manifest),
            (std::map<std::string, std::string>{{"cryptomatte/f834d0a/name", "crypto_object"},
                                                {"cryptomatte/f834d0a/hash", "MurmurHash3_32"},
                                                {"cryptomatte/f834d0a/conversion", "uint32_to_float32"},
                                                {"cryptomatte/f834d0a/manifest", manifest}}));
}

TEST(Cryptomatte, EveryIdentifierIsAnOrdinaryFloat) {
  int turned = 0;
  for (int i = 0; i < 100000; ++i) {
    const std::string name = "thing_" + std::to_string(i);
    const float id = cryptomatte_id(name);
    ASSERT_TRUE(is_identifier(id)) << name;
    turned += std::bit_cast<std::uint32_t>(id) != murmur3_32(name);
  }
  // One hash in 128 has an exponent that no ordinary float has.
  EXPECT_GT(turned, 0);
}

TEST(FinalImage, HasTheRequestedLayers) {
  const AovSet aovs = AovSet{}.with(Aov::depth).with(Aov::normal).with(Aov::shape_id).with(Aov::coverage);
  const TileGrid grid{{20, 12}, 8};
  Film film(grid, aovs);
  // The last tile has no samples.
  for (TileIndex t = 0; t + 1 < grid.count(); ++t)
    ASSERT_TRUE(film.fold(t, 0, fake_partial(make_partial(grid, t, {0, 2}).header, aovs)));
  ExrPicture picture{grid.frame, {}, {}};

  add_aov_layers(film, {.shapes = R"({"a":"3f800000"})"}, {}, picture);

  std::vector<std::string> names;
  for (const auto& [name, channel] : picture.channels) names.push_back(name);
  EXPECT_THAT(names, testing::ElementsAre(
                         "coverage.A", "crypto_object00.A", "crypto_object00.B", "crypto_object00.G",
                         "crypto_object00.R", "crypto_object01.A", "crypto_object01.B", "crypto_object01.G",
                         "crypto_object01.R", "crypto_object02.A", "crypto_object02.B", "crypto_object02.G",
                         "crypto_object02.R", "depth.Z", "normal.X", "normal.Y", "normal.Z"));
  EXPECT_TRUE(std::holds_alternative<ExrFloat>(picture.channels["depth.Z"]));
  EXPECT_TRUE(std::holds_alternative<ExrHalf>(picture.channels["normal.X"]));
  const auto& id = std::get<ExrFloat>(picture.channels["crypto_object00.R"]).values;
  const auto& share = std::get<ExrFloat>(picture.channels["crypto_object00.G"]).values;
  const auto& depth = std::get<ExrFloat>(picture.channels["depth.Z"]).values;
  EXPECT_EQ(id[0], 1);
  EXPECT_EQ(share[0], 1);
  EXPECT_EQ(depth[0], static_cast<float>(film.pixels(0).mean[0]));
  EXPECT_EQ(id.back() + share.back() + depth.back(), 0);
  EXPECT_THAT(picture.strings["cryptomatte/f834d0a/manifest"], HasSubstr("3f800000"));
}

TEST(FinalImage, WithoutAovsHasNoExtraBytes) {
  const Film film = make_film({{20, 12}, 8}, 4);
  Provenance plain, named;
  named.names = {.shapes = "{}", .materials = "{}"};

  EXPECT_EQ(final_exr(film, plain, {})->exr, final_exr(film, named, {})->exr);
}

}  // namespace
}  // namespace ls::test
