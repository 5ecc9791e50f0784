// Names and planes of AOVs; partials, films and merges with AOVs; the errors for damaged partials.
#include "core/image/aov/aov.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>

#include "core/image/exr/final_image.h"
#include "core/image/film/merge.h"
#include "tests/unit/image/support.h"
#include "worker/fake/fake_pixels.h"

namespace ls::test {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

const FrameSize kFrame{20, 12};
const TileGrid kGrid{kFrame, 8};
constexpr AovSet kSome = AovSet{}.with(Aov::depth).with(Aov::albedo).with(Aov::shape_id).with(Aov::direct);

Partial with_aovs(TileIndex tile, SampleRange samples, AovSet aovs = kSome) {
  return fake_partial(make_partial(kGrid, tile, samples).header, aovs);
}
// Returns the index of the partial's plane that has this name.
std::size_t plane(AovSet aovs, std::string_view name) {
  const auto names = planes_of(aovs).names;
  const auto at = std::find(names.begin(), names.end(), name);
  EXPECT_NE(at, names.end()) << name;
  return kPartialChannels + static_cast<std::size_t>(at - names.begin());
}
float& value(Partial& p, std::string_view name, std::size_t pixel) {
  return p.sums[plane(p.aovs, name) * static_cast<std::size_t>(p.header.tile.pixels()) + pixel];
}
std::vector<std::byte> encoded(const Partial& p) {
  auto bytes = encode_partial(p, kFrame);
  EXPECT_TRUE(bytes) << bytes.error().message;
  return bytes.value_or(std::vector<std::byte>{});
}
std::string refusal(const Result<Partial>& got) { return got ? "accepted" : got.error().message; }
std::string not_written(const Partial& p) {
  const auto got = encode_partial(p, kFrame);
  return got ? "accepted" : got.error().message;
}

TEST(Aovs, HaveNamesAndAliases) {
  const auto set = [](std::vector<std::string> names) { return parse_aovs(names).value(); };

  EXPECT_EQ(names_of(set({"uv", "depth", "depth"})), (std::vector<std::string>{"depth", "uv"}));
  EXPECT_EQ(set({"sh_normal", "Crypto-Object"}), set({"normal", "shape_id"}));
  EXPECT_NE(set({"alpha"}), set({"coverage"}));
  EXPECT_TRUE(set({"spp", "stderr"}).empty());
  for (const AovRow& row : aov_rows()) EXPECT_EQ(names_of(set({std::string(row.name)}))[0], row.name);
}

TEST(Aovs, UnknownNameIsRefusedWithTheKnownNames) {
  const std::vector<std::string> names = {"depth", "radiosity\n"};

  const std::string text = parse_aovs(names).error().message;

  EXPECT_THAT(text, HasSubstr("\"radiosity?\""));
  for (const AovRow& row : aov_rows()) EXPECT_THAT(text, HasSubstr(std::string(row.name)));
}

TEST(Aovs, EmptyListAddsNoLayers) {
  EXPECT_EQ(planes_of({}).count(), 0u);
  EXPECT_EQ(partial_bytes_per_pixel({}), 24u);
  EXPECT_EQ(film_bytes_per_pixel({}), 48u);
}

TEST(Aovs, PlanesAreInTheOrderOfTheFile) {
  EXPECT_THAT(planes_of(AovSet{}.with(Aov::depth).with(Aov::direct)).names,
              ElementsAre("aov.depth.Z", "aov.direct.B", "aov.direct.G", "aov.direct.R", "aov.hits"));
  EXPECT_THAT(planes_of(AovSet{}.with(Aov::alpha).with(Aov::volume_opacity)).names,
              ElementsAre("aov.alpha.A.A", "aov.alpha.B.A", "aov.volume_opacity.A.B",
                          "aov.volume_opacity.A.G", "aov.volume_opacity.A.R", "aov.volume_opacity.B.B",
                          "aov.volume_opacity.B.G", "aov.volume_opacity.B.R"));
  EXPECT_EQ(planes_of(AovSet{}.with(Aov::light_groups)).count(), 0u) << "without groups";
  EXPECT_THAT(planes_of(AovSet{}.with(Aov::light_groups).with_groups(2)).names,
              ElementsAre("aov.light_groups.00.A.B", "aov.light_groups.00.A.G", "aov.light_groups.00.A.R",
                          "aov.light_groups.00.B.B", "aov.light_groups.00.B.G", "aov.light_groups.00.B.R",
                          "aov.light_groups.01.A.B", "aov.light_groups.01.A.G", "aov.light_groups.01.A.R",
                          "aov.light_groups.01.B.B", "aov.light_groups.01.B.G", "aov.light_groups.01.B.R"));
  const auto all = planes_of(AovSet(~0u, kMostLightGroups)).names;
  EXPECT_TRUE(std::is_sorted(all.begin(), all.end()));
  EXPECT_EQ(std::adjacent_find(all.begin(), all.end()), all.end());
  for (const std::string& name : all) EXPECT_LE(name.size(), 31u) << name;
}

TEST(Partial, WithAovsSurvivesEncodingBitForBit) {
  for (const AovSet aovs :
       {kSome, AovSet(~0u, 1), AovSet(~0u, kMostLightGroups), AovSet{}.with(Aov::coverage)}) {
    const Partial partial = with_aovs(4, {4, 8}, aovs);
    const auto exr = encoded(partial);

    const auto back = decode_partial(exr, partial.header, kFrame, aovs);
    const auto file = decode_partial_file(exr);

    ASSERT_TRUE(back) << back.error().message;
    EXPECT_EQ(*back, partial);
    ASSERT_TRUE(file) << file.error().message;
    EXPECT_EQ(file->partial, partial);
    EXPECT_EQ(unit_digest(*back), unit_digest(partial));
  }
}

TEST(PartialGate, CountsLightGroups) {
  const AovSet two = AovSet{}.with(Aov::light_groups).with_groups(2);
  const Partial partial = with_aovs(0, {0, 2}, two);
  const auto exr = encoded(partial);

  EXPECT_TRUE(decode_partial(exr, partial.header, kFrame, two));
  for (const std::size_t groups : {std::size_t{0}, std::size_t{1}, std::size_t{3}})
    EXPECT_THAT(refusal(decode_partial(exr, partial.header, kFrame, two.with_groups(groups))),
                HasSubstr("AOVs [light_groups] with 2 light groups"))
        << groups;
  for (const std::string_view other : {"99", "7x", "x0"}) {
    auto bytes = exr;
    const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    const auto at = text.find("aov.light_groups.01.B.R") + 17;
    std::memcpy(bytes.data() + at, other.data(), other.size());
    EXPECT_THAT(refusal(decode_partial(bytes, partial.header, kFrame, two)), HasSubstr("stands where"))
        << other;
  }
}

TEST(LightGroupName, HasLettersDigitsAndLinesOnly) {
  for (const std::string& good : {std::string("key"), std::string("Key_2-b"), std::string(63, 'a')})
    EXPECT_EQ(wrong_light_group(good), "");
  for (const std::string& bad : {std::string(), std::string(64, 'a'), std::string("a.b"), std::string("a b"),
                                 std::string("\xc3\xa9"), std::string("a\0b", 3), std::string("a\n")})
    EXPECT_THAT(wrong_light_group(bad), HasSubstr("a light group's name has 1 to 63")) << bad;
}

TEST(Partial, WithoutAovsHasSixChannels) {
  const Partial partial = make_partial(kGrid, 0, {0, 2});

  const auto exr = encoded(partial);

  const std::string_view text(reinterpret_cast<const char*>(exr.data()), exr.size());
  EXPECT_EQ(text.find("aov."), std::string_view::npos);
  EXPECT_EQ(decode_partial(exr, partial.header, kFrame).value(), partial);
}

TEST(PartialGate, RequiresExactlyTheRequestedAovs) {
  const Partial partial = with_aovs(0, {0, 2}), plain = with_aovs(0, {0, 2}, {});

  EXPECT_THAT(refusal(decode_partial(encoded(partial), partial.header, kFrame)),
              HasSubstr("AOVs [albedo, depth, direct, shape_id], expected the AOVs []"));
  EXPECT_THAT(refusal(decode_partial(encoded(plain), plain.header, kFrame, kSome)), HasSubstr("AOVs []"));
  EXPECT_THAT(refusal(decode_partial(encoded(partial), partial.header, kFrame, kSome.with(Aov::coverage))),
              HasSubstr("expected the AOVs [albedo, coverage"));
}

TEST(PartialGate, RefusesChannelsThatNoAovHas) {
  const Partial partial = with_aovs(0, {0, 2});
  const auto exr = encoded(partial);
  const auto renamed = [&](std::string_view from, std::string_view to) {
    auto bytes = exr;
    const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    std::memcpy(bytes.data() + text.find(from), to.data(), to.size());
    return refusal(decode_partial(bytes, partial.header, kFrame, kSome));
  };

  EXPECT_THAT(renamed("aov.hits", "aov.hitz"), HasSubstr("'aov.hitz' stands where 'aov.hits' belongs"));
  EXPECT_THAT(renamed("aov.depth.Z", "aov.depth.Y"), HasSubstr("stands where 'aov.depth.Z' belongs"));
  EXPECT_THAT(renamed("aov.albedo", "aov.albeda"), HasSubstr("belongs"));
  EXPECT_THAT(renamed("id.shape_id.7.n", "id.shape_id.8.n"), HasSubstr("belongs"));
}

TEST(PartialGate, DetectsEveryFlippedBitOfAnAov) {
  const Partial partial = with_aovs(5, {0, 2});
  const auto good = encoded(partial);
  const Digest digest = unit_digest(partial);
  std::size_t harmless = 0;

  for (std::size_t i = 0; i < good.size(); i += 3) {
    auto exr = good;
    exr[i] ^= std::byte{1 << 6};
    const auto got = decode_partial(exr, partial.header, kFrame, kSome);
    if (got && unit_digest(*got) == digest) ++harmless;
  }

  // Only bytes that are not decoded may change unnoticed: the "linear" hints of the channels, the aspect
  // ratio and the screen window. Every third byte is tested.
  EXPECT_LE(harmless, (planes_of(kSome).count() + 6) * 4 + 16);
}

TEST(PartialGate, RefusesImpossibleCountsAndIdentifiers) {
  const auto told = [](auto change) {
    // Four samples, all with the same object in every pixel.
    Partial partial = with_aovs(0, {4, 8});
    change(partial);
    return not_written(partial);
  };

  EXPECT_THAT(told([](Partial& p) { value(p, "aov.hits", 9) = 5; }),
              HasSubstr("aov.hits of pixel (1, 1) is 5"));
  EXPECT_THAT(told([](Partial& p) { value(p, "aov.hits", 0) = -1; }), HasSubstr("aov.hits"));
  EXPECT_THAT(told([](Partial& p) { value(p, "aov.hits", 0) = .5f; }), HasSubstr("aov.hits"));
  EXPECT_THAT(told([](Partial& p) { value(p, "id.shape_id.0.n", 0) = 5; }), HasSubstr("have 5 samples"));
  EXPECT_THAT(told([](Partial& p) { value(p, "id.shape_id.0.n", 0) = 1.5f; }), HasSubstr("slot 0"));
  EXPECT_THAT(told([](Partial& p) { value(p, "id.shape_id.0.id", 0) = 0; }), HasSubstr("the identifier 0"));
  EXPECT_THAT(told([](Partial& p) { value(p, "id.shape_id.0.id", 0) = 1e-40f; }),
              HasSubstr("the identifier"));
  EXPECT_THAT(told([](Partial& p) { value(p, "id.shape_id.1.id", 0) = 2; }), HasSubstr("slot 1"));
  EXPECT_THAT(told([](Partial& p) { value(p, "id.shape_id.more", 0) = 1; }), HasSubstr("free"));
  EXPECT_THAT(told([](Partial& p) {
                value(p, "id.shape_id.0.n", 0) = 1;
                value(p, "id.shape_id.1.id", 0) = 2;
                value(p, "id.shape_id.1.n", 0) = 2;
              }),
              HasSubstr("slot 1 is out of order"));
  EXPECT_THAT(told([](Partial& p) {
                value(p, "id.shape_id.0.n", 0) = 2;
                value(p, "id.shape_id.1.id", 0) = 1;
                value(p, "id.shape_id.1.n", 0) = 1;
              }),
              HasSubstr("repeats"));
  EXPECT_THAT(told([](Partial& p) { value(p, "aov.depth.Z", 3) = INFINITY; }),
              HasSubstr("aov.depth.Z of pixel (3, 0) is inf"));
  EXPECT_EQ(told([](Partial&) {}), "accepted");
}

// ---- folding ----
Film film_of(std::uint64_t spp, AovSet aovs = kSome) {
  Film film(kGrid, aovs);
  for (TileIndex t = 0; t < kGrid.count(); ++t)
    for (RoundIndex k = 0; k < round_count(spp); ++k) {
      const auto folded = film.fold(t, k, with_aovs(t, cut_range(k, spp), aovs));
      EXPECT_TRUE(folded) << folded.error().message;
    }
  return film;
}

TEST(Film, AddsAovsAsItAddsColour) {
  // The last round is truncated to 8 of its 16 samples.
  const Film film = film_of(24);
  const std::size_t depth = plane(kSome, "aov.depth.Z") * 64;
  std::vector<Partial> rounds;
  for (RoundIndex k = 0; k < round_count(24); ++k) rounds.push_back(with_aovs(1, cut_range(k, 24)));

  const TileAovs tile = film.aov_pixels(1);

  EXPECT_EQ(tile.spp, 24u);
  for (std::size_t i = 0; i < 64; ++i) {
    double sum = 0;  // summed in the order of the rounds
    for (const Partial& round : rounds) sum += round.sums[depth + i];
    EXPECT_EQ(tile.sums[depth - 64 * kPartialChannels + i], sum);
    EXPECT_EQ(tile.sums[planes_of(kSome).hits * 64 + i], 24);
    EXPECT_EQ(tile.ids[i], 1);
    EXPECT_EQ(tile.ids[64 + i], 24);
  }
}

TEST(Film, BeautyHasTheSameBitsWithAndWithoutAovs) {
  const Film plain = film_of(40, {}), rich = film_of(40, AovSet(~0u, 3));

  EXPECT_EQ(pixels_sha256(rich), pixels_sha256(plain));
  EXPECT_EQ(rich.error(), plain.error());
}

TEST(Film, ContinuedFilmWithAovsHasTheBitsOfOneRender) {
  Film film = film_of(24);
  for (TileIndex t = 0; t < kGrid.count(); ++t)
    for (RoundIndex k = film.full_rounds(t); k < round_count(48); ++k)
      ASSERT_TRUE(film.fold(t, k, with_aovs(t, cut_range(k, 48))));

  EXPECT_EQ(film, film_of(48));
}

TEST(Film, WithAovsSurvivesARestart) {
  const Film film = film_of(24);

  Film back(kGrid, kSome);
  for (TileIndex t = 0; t < kGrid.count(); ++t) ASSERT_TRUE(back.load_tile(t, film.save_tile(t)));

  EXPECT_EQ(back, film);
  Film other(kGrid);
  EXPECT_FALSE(other.load_tile(0, film.save_tile(0)));
  EXPECT_EQ(film.memory_bytes(), 240 * (film_bytes_per_pixel(kSome) + partial_bytes_per_pixel(kSome)));
}

TEST(Film, RefusesAPartialOfOtherAovs) {
  Film film(kGrid, kSome);

  EXPECT_THAT(film.fold(0, 0, with_aovs(0, {0, 2}, {})).error().message, HasSubstr("other AOVs"));
}

PartialSource source(std::string name, const Partial& partial) {
  return {std::move(name), [bytes = encoded(partial)] { return Result<std::vector<std::byte>>(bytes); }};
}

TEST(Merge, PartialsWithAovsGiveTheFilm) {
  std::vector<PartialSource> sources;
  for (TileIndex t = kGrid.count(); t-- > 0;)
    for (RoundIndex k = round_count(12); k-- > 0;)
      sources.push_back(source("p", with_aovs(t, cut_range(k, 12))));

  const auto merged = merge_partials(sources);

  ASSERT_TRUE(merged) << merged.error().message;
  EXPECT_EQ(merged->film, film_of(12));
}

TEST(Merge, RefusesPartialsOfDifferentAovs) {
  const auto merged = merge_partials(
      {source("a.exr", with_aovs(0, {0, 2})), source("b.exr", with_aovs(1, {0, 2}, kSome.with(Aov::uv)))});

  EXPECT_THAT(merged.error().message, HasSubstr("b.exr is of another set of AOVs than a.exr"));
}

}  // namespace
}  // namespace ls::test
