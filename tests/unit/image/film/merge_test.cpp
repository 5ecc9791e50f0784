#include "core/image/film/merge.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "core/image/exr/final_image.h"
#include "core/image/frame/render_limits.h"
#include "tests/unit/image/support.h"

namespace ls {
namespace {

using test::make_film;
using test::make_partial;
using test::make_round;
using ::testing::AllOf;
using ::testing::HasSubstr;

const TileGrid kGrid{{20, 13}, 8};

PartialSource source_of(const Partial& p, std::string suffix = "", FrameSize frame = kGrid.frame) {
  auto exr = encode_partial(p, frame).value();
  std::string name = "x" + std::to_string(p.header.tile.x0) + "y" + std::to_string(p.header.tile.y0) + "s" +
                     std::to_string(p.header.samples.s0) + suffix + ".exr";
  return {std::move(name), [exr]() -> Result<std::vector<std::byte>> { return exr; }};
}

std::vector<PartialSource> all_of(std::uint64_t spp) {
  std::vector<PartialSource> out;
  for (TileIndex t = 0; t < kGrid.count(); ++t)
    for (RoundIndex k = 0; k < round_count(spp); ++k) out.push_back(source_of(make_round(kGrid, t, k, spp)));
  return out;
}

std::string refusal(const std::vector<PartialSource>& sources) {
  const auto got = merge_partials(sources);
  return got ? "accepted" : got.error().message;
}

TEST(Merge, GivesTheCoordinatorsFilmForAnyOrderOfFiles) {
  for (const std::uint64_t spp : {2u, 6u, 70u}) {
    auto sources = all_of(spp);
    std::shuffle(sources.begin(), sources.end(), std::mt19937(7));

    const auto merged = merge_partials(sources);

    ASSERT_TRUE(merged) << merged.error().message;
    EXPECT_EQ(merged->film, make_film(kGrid, spp));
    EXPECT_EQ(merged->scene, test::name_of("scene"));
    EXPECT_EQ(merged->duplicates, 0u);
  }
}

TEST(Merge, RefusesAFrameWithTooManyTiles) {
  const TileGrid vast{{kMaxFrameSide, kMaxFrameSide}, 1};
  EXPECT_THAT(refusal({source_of(make_round(vast, 0, 0, 2), "", vast.frame)}), HasSubstr("1073741824 tiles"));
}

TEST(Merge, DropsEqualDuplicatesAndCountsThem) {
  auto sources = all_of(6);
  sources.push_back(sources[0]);
  sources.push_back(sources[4]);

  const auto merged = merge_partials(sources);

  ASSERT_TRUE(merged) << merged.error().message;
  EXPECT_EQ(merged->duplicates, 2u);
  EXPECT_EQ(merged->film, make_film(kGrid, 6));
}

TEST(Merge, RefusesDuplicatesThatDifferNamingBoth) {
  auto sources = all_of(4);
  Partial wrong = make_partial(kGrid, 0, {0, 2});
  wrong.sums[3] += 1;
  sources.push_back(source_of(wrong, "-wrong"));

  EXPECT_THAT(refusal(sources),
              AllOf(HasSubstr("x0y0s0.exr"), HasSubstr("x0y0s0-wrong.exr"), HasSubstr("differ")));
}

TEST(Merge, PrefersTheFullRoundToATruncatedOne) {
  auto sources = all_of(6);
  for (TileIndex t = 0; t < kGrid.count(); ++t) sources.push_back(source_of(make_partial(kGrid, t, {4, 8})));

  const auto merged = merge_partials(sources);

  ASSERT_TRUE(merged) << merged.error().message;
  EXPECT_EQ(merged->film, make_film(kGrid, 8));
}

TEST(Merge, NamesGapsAndOverlaps) {
  auto gap = all_of(8);
  std::erase_if(gap, [](const PartialSource& s) { return s.name == "x8y0s2.exr"; });
  EXPECT_THAT(refusal(gap), AllOf(HasSubstr("tile 1 [8,0,16,8]"),
                                  HasSubstr("samples [2, 4) are missing before x8y0s4.exr")));

  auto overlap = all_of(8);
  overlap.push_back(source_of(make_partial(kGrid, 1, {6, 8})));
  EXPECT_THAT(refusal(overlap), AllOf(HasSubstr("tile 1"), HasSubstr("[6, 8)"), HasSubstr("overlap")));

  auto no_tile = all_of(2);
  std::erase_if(no_tile, [](const PartialSource& s) { return s.name == "x16y8s0.exr"; });
  EXPECT_THAT(refusal(no_tile), HasSubstr("no partial of tile 5 [16,8,20,13]"));

  auto cut_in_between = all_of(4);
  cut_in_between.push_back(source_of(make_partial(kGrid, 2, {4, 6})));
  cut_in_between.push_back(source_of(make_partial(kGrid, 2, {6, 8})));
  EXPECT_THAT(refusal(cut_in_between), HasSubstr("x16y0s6.exr"));
}

TEST(Merge, RefusesPartialsOfAnotherJob) {
  const auto with = [](auto change) {
    auto sources = all_of(2);
    Partial other = make_partial(kGrid, 0, {2, 4});
    change(other.header);
    sources.push_back(source_of(other));
    return refusal(sources);
  };
  EXPECT_THAT(with([](UnitHeader& h) { h.scene.bytes[3] ^= 1; }), HasSubstr("another scene"));
  EXPECT_THAT(with([](UnitHeader& h) { h.settings.bytes[3] ^= 1; }), HasSubstr("settings"));
  EXPECT_THAT(with([](UnitHeader& h) { h.numeric_class.bytes[3] ^= 1; }), HasSubstr("numeric class"));

  auto frames = all_of(2);
  frames.push_back(source_of(make_partial(kGrid, 0, {2, 4}), "", {20, 14}));
  EXPECT_THAT(refusal(frames), HasSubstr("frame size"));

  auto tilings = all_of(2);
  tilings.push_back(source_of(make_partial(TileGrid{kGrid.frame, 5}, 1, {0, 2})));
  EXPECT_THAT(refusal(tilings), HasSubstr("does not fit a tiling"));
}

TEST(Merge, NamesTheFileThatIsDamaged) {
  auto sources = all_of(2);
  sources[2].read = []() -> Result<std::vector<std::byte>> { return std::vector<std::byte>(100); };
  EXPECT_THAT(refusal(sources), AllOf(HasSubstr(sources[2].name), HasSubstr("magic")));

  sources[2].read = []() -> Result<std::vector<std::byte>> { return fail(Errc::not_found, "gone"); };
  EXPECT_EQ(refusal(sources), "gone");
  EXPECT_THAT(refusal({}), HasSubstr("no partials"));
}

TEST(Merge, DetectsAFileThatChangesWhileReading) {
  auto sources = all_of(2);
  auto count = std::make_shared<int>(0);
  sources[0].read = [count]() {
    Partial p = make_partial(kGrid, 0, {0, 2});
    p.sums[0] += static_cast<float>((*count)++);
    return encode_partial(p, kGrid.frame);
  };
  EXPECT_THAT(refusal(sources), HasSubstr("changed while it was read"));
}

}  // namespace
}  // namespace ls
