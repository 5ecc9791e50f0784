#include "common/assets/grid_files.h"

#include <gmock/gmock.h>

#include <limits>

#include "tests/unit/assets/hostile.h"

namespace ls {
namespace {

using test::append;
using test::bytes_of;
using testing::ElementsAre;
using testing::HasSubstr;

struct VolFile {
  int type = 1, nx = 2, ny = 3, nz = 1, channels = 1;
  std::vector<float> box{-1, -2, -3, 1, 2, 3};
  std::string values;

  std::string text() const {
    std::string s = "VOL\3";
    for (const std::int32_t v : {type, nx, ny, nz, channels}) append(s, v);
    for (const float v : box) append(s, v);
    return s + values;
  }
};
VolFile floats(std::initializer_list<float> v) {
  VolFile f;
  for (const float x : v) append(f.values, x);
  return f;
}
std::string error(const VolFile& f) {
  const auto g = decode_vol("g.vol", bytes_of(f.text()));
  return g ? "" : g.error().message;
}

TEST(Vol, ReadsFloatsWithXFastestAndTheirBox) {
  const auto g = decode_vol("g.vol", bytes_of(floats({0, 1, 2, 3, 4, 5}).text()));

  ASSERT_TRUE(g) << g.error().message;
  EXPECT_EQ(g->nx, 2u);
  EXPECT_EQ(g->ny, 3u);
  EXPECT_EQ(g->nz, 1u);
  EXPECT_THAT(g->values, ElementsAre(0, 1, 2, 3, 4, 5));
  EXPECT_THAT(g->bbox_min, ElementsAre(-1, -2, -3));
  EXPECT_THAT(g->bbox_max, ElementsAre(1, 2, 3));
}

TEST(Vol, ReadsHalfsAndBytes) {
  VolFile half;
  half.type = 2;
  for (const std::uint16_t h : {0x3c00, 0x3800, 0x0000, 0x4000, 0x3c00, 0x3c00}) append(half.values, h);
  VolFile bytes;
  bytes.type = 3;
  bytes.values = std::string("\xff\x00\x33\xff\xff\xff", 6);

  const auto h = decode_vol("g.vol", bytes_of(half.text())), b = decode_vol("g.vol", bytes_of(bytes.text()));

  ASSERT_TRUE(h && b);
  EXPECT_THAT(h->values, ElementsAre(1, .5f, 0, 2, 1, 1));
  EXPECT_THAT(b->values, ElementsAre(1, 0, .2f, 1, 1, 1));
}

TEST(Vol, MakesNegativesZeroAndCountsThem) {
  const auto g = decode_vol("g.vol", bytes_of(floats({0, -1, 2, -3, 4, 5}).text()));

  ASSERT_TRUE(g) << g.error().message;
  EXPECT_EQ(g->negatives, 2u);
  EXPECT_THAT(g->values, ElementsAre(0, 0, 2, 0, 4, 5));
}

TEST(Vol, RefusesValuesThatAreNotFiniteWithTheirVoxel) {
  const float inf = std::numeric_limits<float>::infinity(), nan = std::numeric_limits<float>::quiet_NaN();
  EXPECT_THAT(error(floats({0, 1, 2, nan, 4, 5})), HasSubstr("'g.vol': the voxel (1, 1, 0) is not a number"));
  EXPECT_THAT(error(floats({0, 1, 2, 3, inf, 5})), HasSubstr("the voxel (0, 2, 0) is infinite"));
}

TEST(Vol, RefusesHeadersThatTheFileDoesNotBear) {
  VolFile f = floats({0, 1, 2, 3, 4, 5});
  f.nx = 3;
  EXPECT_THAT(error(f),
              HasSubstr("3 x 3 x 1 voxels of 1 channel(s) need 36 bytes after the header, but 24 are there"));
  f.nx = 2147483647, f.ny = 2147483647;
  EXPECT_THAT(error(f), HasSubstr("2147483647 voxels along an axis"));
  f.nx = f.ny = f.nz = 8000;
  EXPECT_THAT(error(f), HasSubstr("more than the limit"));
  f = floats({0, 1, 2, 3, 4, 5});
  f.nx = 0;
  EXPECT_THAT(error(f), HasSubstr("0 voxels"));
  f.nx = 2, f.channels = 2;
  EXPECT_THAT(error(f), HasSubstr("2 channels"));
  f.channels = 1, f.type = 9;
  EXPECT_THAT(error(f), HasSubstr("value type 9"));
  f.type = 1, f.box[3] = -5;
  EXPECT_THAT(error(f), HasSubstr("bounding box"));
}

TEST(Vol, NeverAcceptsATruncatedFileAndSurvivesMutations) {
  const std::string file = floats({0, 1, 2, 3, 4, 5}).text();

  EXPECT_EQ(test::accepted_truncations(file, decode_vol), 0);
  test::survive_mutations(file, decode_vol, [](const GridData& g) {
    EXPECT_EQ(g.values.size(), std::size_t{g.nx} * g.ny * g.nz * g.channels);
    for (const float v : g.values) EXPECT_TRUE(v >= 0 && v <= std::numeric_limits<float>::max());
  });
}

}  // namespace
}  // namespace ls
