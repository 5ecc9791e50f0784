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

TEST(RawGrid, MakesNegativesZeroAndRefusesWhatIsNoNumberWithItsNode) {
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

TEST(RawGrid, RefusesHeadersThatTheFileDoesNotBear) {
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
