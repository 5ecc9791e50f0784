#include "core/assets/grid_files.h"

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

TEST(Vol, RefusesHeadersThatExceedTheFile) {
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

struct RawFile {
  std::int32_t nx = 2, ny = 3, nz = 2;
  std::vector<float> box{-1, -2, -3, 1, 2, 3};
  std::vector<float> values{0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11};

  std::string text() const {
    std::string s;
    for (const std::int32_t v : {nx, ny, nz}) append(s, v);
    for (const float v : box) append(s, v);
    for (const float v : values) append(s, v);
    return s;
  }
};
Result<GridData> decode_raw(std::string_view name, std::span<const std::byte> file) {
  return decode_raw_grid(name, file, GridOrder::x_fastest);
}
std::string error(const RawFile& f) {
  const auto g = decode_raw("g.bin", bytes_of(f.text()));
  return g ? "" : g.error().message;
}

TEST(RawGrid, IsReadInEitherOrder) {
  const RawFile f;

  const auto x = decode_raw("g.bin", bytes_of(f.text())),
             z = decode_raw_grid("g.bin", bytes_of(f.text()), GridOrder::z_fastest);

  ASSERT_TRUE(x && z);
  EXPECT_EQ(x->nx, 2u);
  EXPECT_EQ(x->ny, 3u);
  EXPECT_EQ(x->nz, 2u);
  EXPECT_EQ(x->channels, 1u);
  EXPECT_THAT(x->values, ElementsAre(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11));
  // The file's value number 2 (3 x + y) + z belongs to the node (x, y, z). Value number i is i.
  EXPECT_THAT(z->values, ElementsAre(0, 6, 2, 8, 4, 10, 1, 7, 3, 9, 5, 11));
  EXPECT_THAT(x->bbox_min, ElementsAre(-1, -2, -3));
  EXPECT_THAT(x->bbox_max, ElementsAre(1, 2, 3));
}

TEST(RawGrid, ClampsNegativeValuesAndRefusesNonNumbersNamingTheNode) {
  RawFile f;
  f.values[7] = -2;
  const auto g = decode_raw("g.bin", bytes_of(f.text()));
  ASSERT_TRUE(g);
  EXPECT_EQ(g->negatives, 1u);
  EXPECT_EQ(g->values[7], 0);
  f.values[7] = std::numeric_limits<float>::quiet_NaN();
  EXPECT_THAT(error(f), HasSubstr("'g.bin': the node (1, 0, 1) is not a number"));
  f.values[7] = -std::numeric_limits<float>::infinity();
  EXPECT_THAT(error(f), HasSubstr("the node (1, 0, 1) is infinite"));
}

TEST(RawGrid, RefusesHeadersThatExceedTheFile) {
  RawFile f;
  f.nx = 3;
  EXPECT_THAT(error(f), HasSubstr("3 x 3 x 2 nodes need 72 bytes after the header, but 48 are there"));
  f.nx = -2;
  EXPECT_THAT(error(f), HasSubstr("-2 nodes along an axis"));
  f.nx = 1;
  EXPECT_THAT(error(f), HasSubstr("1 nodes along an axis; 2 to"));
  f.nx = f.ny = f.nz = 2147483647;
  EXPECT_THAT(error(f), HasSubstr("2147483647 nodes along an axis"));
  f.nx = f.ny = f.nz = 8000;
  EXPECT_THAT(error(f), HasSubstr("more than the limit"));
  f = {};
  f.box[4] = -2;
  EXPECT_THAT(error(f), HasSubstr("empty or not finite along axis 1: -2 to -2"));
  f.box[4] = std::numeric_limits<float>::infinity();
  EXPECT_THAT(error(f), HasSubstr("along axis 1"));
}

TEST(RawGrid, NeverAcceptsATruncatedFileAndSurvivesMutations) {
  const std::string file = RawFile{}.text();

  EXPECT_EQ(test::accepted_truncations(file, decode_raw), 0);
  test::survive_mutations(file, decode_raw, [](const GridData& g) {
    EXPECT_EQ(g.values.size(), std::size_t{g.nx} * g.ny * g.nz);
    for (const float v : g.values) EXPECT_TRUE(v >= 0 && v <= std::numeric_limits<float>::max());
  });
}

}  // namespace
}  // namespace ls
