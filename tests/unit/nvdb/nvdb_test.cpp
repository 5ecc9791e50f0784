#include "worker/render/vdb/nvdb.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>
#include <vector>

#include "tests/unit/nvdb/bricks_values.h"
#include "tests/unit/nvdb/nvdb_builder.h"

namespace ls::render {
namespace {

using test::NvdbBuilder;
using testing::HasSubstr;

struct Read {
  VdbShape grid{};
  std::string error;
  std::vector<float> values;

  float at(int x, int y, int z, int channel = 0) const {
    const int node = (z * grid.size[1] + y) * grid.size[0] + x;
    return values.at(static_cast<std::size_t>(grid.channels * node + channel));
  }
};

Read read(const std::string& file, const std::string& wanted = "", std::uint64_t max_bytes = 1 << 25) {
  Read r;
  try {
    const VdbVoxels voxels =
        decode_nvdb(std::as_bytes(std::span(file.data(), file.size())), wanted, max_bytes);
    r.grid = voxels.shape;
    // A mutation may ask for a box of billions of voxels.
    if (double{1} * r.grid.size[0] * r.grid.size[1] * r.grid.size[2] < 1 << 20)
      r.values = test::values_of(test::with_bricks(voxels));
  } catch (const Refused& e) {
    r.error = e.text;
  }
  return r;
}

// Active voxels 0..23, 0..7, 0..7, with a layer around them.
void expect_the_kits_values(const Read& r, const NvdbBuilder& builder, float step = 1) {
  ASSERT_EQ(r.error, "");
  EXPECT_EQ(r.grid.size[0], 26);
  EXPECT_EQ(r.grid.size[1], 10);
  EXPECT_EQ(r.grid.size[2], 10);
  for (int z = -1; z < 9; ++z)
    for (int y = -1; y < 9; ++y)
      for (int x = -1; x < 25; ++x) {
        const bool inside = x >= 0 && x < 24 && y >= 0 && y < 8 && z >= 0 && z < 8;
        const float value = builder.value(x, y, z), held = x < 16 ? std::floor(value / step) * step : value;
        for (int c = 0; c < r.grid.channels; ++c)
          ASSERT_EQ(r.at(x + 1, y + 1, z + 1, c), NvdbBuilder::of_channel(inside ? held : builder.background,
                                                                          static_cast<std::uint64_t>(c)))
              << x << " " << y << " " << z << " " << c;
      }
}

TEST(Nvdb, ReadsEveryKindOfNumber) {
  for (const std::uint32_t type : {1, 2, 6, 7, 9, 13, 14, 15, 16}) {
    NvdbBuilder builder;
    builder.type = type;
    SCOPED_TRACE(type);
    const Read r = read(builder.file());
    EXPECT_EQ(r.grid.channels, static_cast<int>(builder.channels()));
    expect_the_kits_values(r, builder, type == 13 ? 16 : 1);
  }
}

TEST(Nvdb, ReadsEveryCompression) {
  for (const std::uint16_t codec : {0, 1, 2}) {
    NvdbBuilder builder;
    builder.codec = codec;
    SCOPED_TRACE(codec);
    expect_the_kits_values(read(builder.file()), builder);
  }
}

TEST(Nvdb, PlacesTheGridByItsMap) {
  const NvdbBuilder builder;
  const Read r = read(builder.file());
  // Node (0, 0, 0) is the voxel before the first active one.
  const double x = builder.origin[0] - 1, y = builder.origin[1] - 1, z = builder.origin[2] - 1;
  const double expected[16] = {.5, 0, 0, .5 * x + 1, 0, 2, 0, 2 * y + 2, 0, 0, 1, z + 3, 0, 0, 0, 1};
  for (int i = 0; i < 16; ++i) EXPECT_EQ(r.grid.index_to_scene[i], expected[i]) << i;
}

TEST(Nvdb, ReadsRootTilesAndNegativeCoordinates) {
  NvdbBuilder builder;
  builder.background = -1;
  std::string b = builder.buffer();
  const Read r = read(builder.file(b));
  EXPECT_EQ(r.at(0, 0, 0), 0);
  EXPECT_EQ(r.grid.negatives, 26u * 10 * 10 - 24 * 8 * 8);
  // Without its child the root's tile is a value.
  NvdbBuilder::put(b, builder.upper() - 32 + 8, std::int64_t{0});
  NvdbBuilder::put(b, builder.upper() - 32 + 20, 7.f);
  EXPECT_EQ(read(builder.file(b)).at(5, 5, 5), 7);
}

// All 4096^3 voxels of a root's tile, of which only those on its faces need bricks of their own.
TEST(Nvdb, LargeTilesAreNotExpanded) {
  NvdbBuilder builder;
  builder.hi = {4095, 4095, 4095};
  std::string b = builder.buffer();
  NvdbBuilder::put(b, builder.upper() - 32 + 8, std::int64_t{0});
  NvdbBuilder::put(b, builder.upper() - 32 + 20, 7.f);
  const std::string file = builder.file(b);

  const VdbVoxels voxels = decode_nvdb(std::as_bytes(std::span(file)), "", 1 << 20);

  EXPECT_EQ(voxels.shape.size[0], 4098);
  EXPECT_TRUE(voxels.tree.leaves.empty());
  const VdbGrid grid = test::with_bricks(voxels);
  EXPECT_LT(BrickTables(grid.channels[0]).bytes(), 1u << 20);
  const Bricks bricks(voxels.shape.size_of_box(), voxels.shape.lead_of_box(), grid.channels[0]);
  for (const int x : {0, 1, 4096, 4097}) EXPECT_EQ(bricks.at(x, 5, 4096), x > 0 && x < 4097 ? 7 : .25f);
}

TEST(Nvdb, ChoosesAGridByItsName) {
  NvdbBuilder a, b;
  a.name = "temperature";
  a.background = 3;
  b.codec = 1;
  const std::string both = a.file() + b.file();  // two segments
  EXPECT_EQ(read(both).at(0, 0, 0), .25f);
  EXPECT_EQ(read(both, "temperature").at(0, 0, 0), 3);
  EXPECT_THAT(read(both, "flame").error,
              HasSubstr("it has no grid 'flame'; there are 'temperature', 'density'"));
  b.name = "fuel";
  EXPECT_THAT(read(a.file() + b.file()).error, HasSubstr("no single one is called 'density'; name one of"));
}

TEST(Nvdb, RefusesGridsThatAreNotDensitiesByName) {
  NvdbBuilder builder;
  builder.grid_class = 1;
  EXPECT_THAT(read(builder.file()).error, HasSubstr("grid 'density' is a level set"));
  builder.grid_class = 0;
  for (const auto& [type, name] :
       {std::pair{4u, "int32"}, {17u, "vec4f"}, {19u, "index"}, {77u, "number 77"}}) {
    builder.type = type;
    EXPECT_THAT(read(builder.file()).error, HasSubstr(std::string("has values of type ") + name));
  }
  builder.type = 1;
  builder.version = 33u << 21;
  EXPECT_THAT(read(builder.file()).error, HasSubstr("version 33.0; known is version 32"));
  builder.version = 19;
  EXPECT_THAT(read(builder.file()).error, HasSubstr("version 19; known is version 32"));
  builder = {};
  builder.hi = {-1, -1, -1};
  EXPECT_THAT(read(builder.file()).error, HasSubstr("is empty"));
}

TEST(Nvdb, RefusesTooLargeGridsBeforeAllocating) {
  // The box is in 2 x 2 x 2 entries of the table, one of which is a node of 16 KiB with two leaves of 2 KiB
  // for each channel, and there are three constants.
  constexpr std::uint64_t kNode = 4 * (4096 + 8), kLeaf = 4 * 512, kConstants = 3 * 4;
  NvdbBuilder builder;
  EXPECT_THAT(read(builder.file(), "", kNode + 2 * kLeaf - 1).error,
              HasSubstr("grid 'density' of 26 x 10 x 10 voxels takes more than 0 MiB of memory"));
  EXPECT_EQ(read(builder.file(), "", kNode + 2 * kLeaf + kConstants).error, "");
  builder.type = 6;
  EXPECT_THAT(read(builder.file(), "", kNode + 6 * kLeaf - 1).error, HasSubstr("takes more than"));
  EXPECT_EQ(read(builder.file(), "", kNode + 6 * kLeaf + 3 * kConstants).error, "");
  builder.type = 1;
  builder.hi[1] = 20000;
  EXPECT_THAT(read(builder.file()).error, HasSubstr("spans 20003 voxels along an axis; the limit is 16384"));
  builder = {};
  builder.codec = 1;
  std::string f = builder.file();
  NvdbBuilder::put(f, 16, std::uint64_t{1} << 60);
  EXPECT_THAT(read(f).error, HasSubstr("is damaged"));
}

TEST(Nvdb, RefusesDamage) {
  const NvdbBuilder builder;
  const auto with = [&](std::uint64_t at, auto v) {
    std::string b = builder.buffer();
    NvdbBuilder::put(b, at, v);
    return read(builder.file(b)).error;
  };
  const float nan = std::nanf("");
  EXPECT_THAT(with(builder.leaf(0) + 96, nan),
              HasSubstr("voxel (-4096, 0, 8192) of grid 'density' is not a finite"));
  EXPECT_THAT(with(0, 'X'), HasSubstr("begins with something else"));
  EXPECT_THAT(with(32, std::uint64_t{5}), HasSubstr("its sizes contradict each other"));
  EXPECT_THAT(with(672 + 24, ~std::uint64_t{0}), HasSubstr("its tree lies before it"));
  EXPECT_THAT(with(672 + 24, std::uint64_t{1} << 40), HasSubstr("damaged"));
  EXPECT_THAT(with(builder.upper() - 32 + 8, std::int64_t{1} << 62), HasSubstr("damaged"));
  EXPECT_THAT(with(builder.upper() - 32 + 8, std::int64_t{-8}), HasSubstr("points backwards"));
  EXPECT_THAT(with(builder.lower() + 1088, std::int64_t{1} << 40), HasSubstr("damaged"));
  EXPECT_THAT(with(296 + 88, std::numeric_limits<double>::infinity()),
              HasSubstr("its transform is not finite"));
  std::string b = builder.buffer();
  NvdbBuilder::put(b, NvdbBuilder::kRoot + 24, std::uint32_t{2});
  std::string twice =
      b.substr(0, builder.upper() - 32) + b.substr(builder.upper() - 32, 32) + b.substr(builder.upper() - 32);
  NvdbBuilder::put(twice, 32, std::uint64_t{twice.size()});
  EXPECT_THAT(read(builder.file(twice)).error, HasSubstr("two of its tiles are at one place"));
}

// A file that was cut off gives an error at whatever byte; one whose bytes were changed an answer.
TEST(Nvdb, SurvivesTruncationsAndMutations) {
  std::mt19937 rng(5);
  for (const std::uint16_t codec : {1, 2}) {
    NvdbBuilder builder;
    builder.codec = codec;
    const std::string file = builder.file();
    for (std::size_t n = 1; n < file.size(); n += 1 + n / 64)
      EXPECT_NE(read(file.substr(0, n)).error, "") << codec << " " << n;
  }
  const NvdbBuilder builder;
  const std::string file = builder.file();
  for (int i = 0; i < 400; ++i) {
    std::string m = file;
    for (int e = 0; e < 4; ++e) {
      // Half of them where headers and pointers are.
      const std::size_t head = 193 + 672 + 64 + 64 + 32;
      const std::size_t at = e < 3 ? rng() % head : rng() % m.size();
      m[at] = static_cast<char>(rng());
    }
    const Read r = read(m, "", 1 << 20);
    for (const float v : r.values) ASSERT_TRUE(v >= 0 && std::isfinite(v));
  }
}

}  // namespace
}  // namespace ls::render
