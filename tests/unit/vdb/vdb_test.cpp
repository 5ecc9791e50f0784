// What the module makes of OpenVDB files of every kind of grid, of points among them, and of files of older
// versions of the format. All of them are written here.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <openvdb/io/File.h>
#include <openvdb/io/Stream.h>
#include <openvdb/openvdb.h>
#include <unistd.h>
#include <zlib.h>

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

#include "tests/unit/nvdb/bricks_values.h"
#include "worker/render/media/vdb_reply.h"

// OpenVDB frees not all of what it has read of a file that turns out to be damaged. lightshaft-vdb reads one
// file and ends, so nothing gathers; LeakSanitizer asks this function what it shall not report.
extern "C" const char* __lsan_default_suppressions();
extern "C" const char* __lsan_default_suppressions() { return "leak:libopenvdb"; }

namespace {

using ls::render::Bricks;
using ls::render::BrickTables;
using ls::render::read_vdb;
using ls::render::VdbGrid;
using ls::render::VdbShape;
using testing::HasSubstr;

class Scratch {
 public:
  Scratch()
      : path_(std::filesystem::temp_directory_path() / ("vdb-test-" + std::to_string(::getpid()) + ".vdb")) {}
  ~Scratch() {
    std::error_code ec;
    std::filesystem::remove(path_, ec);
  }
  Scratch(const Scratch&) = delete;
  Scratch& operator=(const Scratch&) = delete;
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

struct Read {
  std::string error;
  VdbShape grid{};
  std::vector<float> values;

  float at(int x, int y, int z, int channel = 0) const {
    const int node = (z * grid.size[1] + y) * grid.size[0] + x;
    return values.at(static_cast<std::size_t>(grid.channels * node + channel));
  }
};

Read read(const std::filesystem::path& path, std::uint64_t max_bytes = 1 << 25) {
  Read r;
  VdbGrid grid;
  if (read_vdb(path.string(), "", max_bytes, grid, r.error) != 0) return r;
  r.grid = grid.shape;
  r.values = ls::test::values_of(grid);
  return r;
}

void write(const std::filesystem::path& path, const openvdb::GridBase::Ptr& grid,
           std::uint32_t compression = openvdb::io::COMPRESS_ACTIVE_MASK) {
  grid->setName("density");
  openvdb::io::File file(path.string());
  file.setCompression(compression);
  file.write({grid});
  file.close();
}

// Active from (0, 0, 0) to (9, 4, 2), with a number of its own for each voxel.
// OpenVDB's own factory makes the grid, since compiling a tree's constructor costs seconds for each type.
template <class GridType, class Make>
typename GridType::Ptr filled(Make value) {
  const auto grid = openvdb::gridPtrCast<GridType>(openvdb::GridBase::createGrid(GridType::gridType()));
  auto access = grid->getAccessor();
  for (int x = 0; x < 10; ++x)
    for (int y = 0; y < 5; ++y)
      for (int z = 0; z < 3; ++z) access.setValue(openvdb::Coord(x, y, z), value(x + 10 * y + 100 * z));
  grid->setGridClass(openvdb::GRID_FOG_VOLUME);
  return grid;
}
// One layer of background around them; channel c holds (c + 1) times the number.
void expect_them(const Read& r, int channels) {
  ASSERT_EQ(r.error, "");
  EXPECT_EQ(r.grid.channels, channels);
  EXPECT_EQ(r.grid.size[0], 12);
  EXPECT_EQ(r.grid.size[1], 7);
  EXPECT_EQ(r.grid.size[2], 5);
  for (int z = 0; z < 5; ++z)
    for (int y = 0; y < 7; ++y)
      for (int x = 0; x < 12; ++x)
        for (int c = 0; c < channels; ++c) {
          const bool inside = x > 0 && x < 11 && y > 0 && y < 6 && z > 0 && z < 4;
          const int value = inside ? (x - 1 + 10 * (y - 1) + 100 * (z - 1)) * (c + 1) : 0;
          ASSERT_EQ(r.at(x, y, z, c), static_cast<float>(value)) << x << " " << y << " " << z << " " << c;
        }
}
template <class T>
openvdb::math::Vec3<T> three(int i) {
  return {static_cast<T>(i), static_cast<T>(2 * i), static_cast<T>(3 * i)};
}

class Vdb : public testing::Test {
 protected:
  Vdb() { openvdb::initialize(); }
  Scratch file_;
};

TEST_F(Vdb, ReadsOneAndThreeNumbersPerVoxel) {
  write(file_.path(), filled<openvdb::FloatGrid>([](int i) { return static_cast<float>(i); }));
  expect_them(read(file_.path()), 1);
  write(file_.path(), filled<openvdb::DoubleGrid>([](int i) { return static_cast<double>(i); }));
  expect_them(read(file_.path()), 1);
  write(file_.path(), filled<openvdb::Vec3SGrid>(three<float>));
  expect_them(read(file_.path()), 3);
  write(file_.path(), filled<openvdb::Vec3DGrid>(three<double>));
  expect_them(read(file_.path()), 3);
}

TEST_F(Vdb, ReadsHalfFloats) {
  const auto grid = filled<openvdb::FloatGrid>([](int i) { return static_cast<float>(i); });
  grid->setSaveFloatAsHalf(true);
  write(file_.path(), grid);
  expect_them(read(file_.path()), 1);
}

TEST_F(Vdb, NegativesOfEveryChannelAreCounted) {
  write(file_.path(), filled<openvdb::Vec3SGrid>([](int i) {
          return i == 0 ? openvdb::Vec3s(1, -2, -3) : openvdb::Vec3s(1, 2, 3);
        }));

  const Read r = read(file_.path());

  EXPECT_EQ(r.grid.negatives, 2u);
  EXPECT_EQ(r.at(1, 1, 1, 0), 1);
  EXPECT_EQ(r.at(1, 1, 1, 1), 0);
}

TEST_F(Vdb, LimitIsOfTheBytesInMemory) {
  write(file_.path(), filled<openvdb::Vec3SGrid>(three<float>));
  VdbGrid grid;
  std::string error;
  ASSERT_EQ(read_vdb(file_.path().string(), "", 1 << 25, grid, error), 0);
  std::uint64_t bytes = 0;
  for (const BrickTables bricks : grid.channels) bytes += bricks.bytes();

  EXPECT_EQ(read(file_.path(), bytes).error, "");
  EXPECT_THAT(read(file_.path(), bytes - 1).error,
              HasSubstr("grid 'density' of 12 x 7 x 5 voxels takes more than 0 MiB of memory"));
  EXPECT_THAT(read(file_.path(), 100).error, HasSubstr("takes more than"));
}

// At the ends of what coordinates can be, in one leaf and in two, and at no multiple of anything.
TEST_F(Vdb, ReadsVoxelsAtAnyCoordinates) {
  constexpr int kLast = std::numeric_limits<int>::max(), kFirst = std::numeric_limits<int>::min();
  for (const int at : {kFirst, -(1 << 30) - 1, -(1 << 30), -5, 0, 127, (1 << 30) - 1, 1 << 30, kLast - 1}) {
    SCOPED_TRACE(at);
    const auto grid = filled<openvdb::FloatGrid>([](int) { return 0.f; });
    grid->clear();
    grid->getAccessor().setValue({at, at, at}, 2);
    grid->getAccessor().setValue({at + 1, at, at}, 3);
    write(file_.path(), grid);

    const Read r = read(file_.path());

    ASSERT_EQ(r.error, "");
    EXPECT_EQ(r.grid.size[0], 4);
    EXPECT_EQ(r.grid.size[2], 3);
    EXPECT_EQ(r.grid.index_to_scene[3], double{at} - 1);
    EXPECT_EQ(r.at(0, 1, 1), 0);
    EXPECT_EQ(r.at(1, 1, 1), 2);
    EXPECT_EQ(r.at(2, 1, 1), 3);
    EXPECT_EQ(r.at(3, 1, 1), 0);
    EXPECT_EQ(r.at(1, 0, 1), 0);
    EXPECT_EQ(r.at(1, 1, 2), 0);
  }
}

TEST_F(Vdb, VoxelsFarApartTakeTheMemoryOfAFew) {
  const auto grid = filled<openvdb::FloatGrid>([](int) { return 0.f; });
  grid->clear();
  grid->getAccessor().setValue({-8000, 3, 8000}, 2);
  grid->getAccessor().setValue({8000, 8003, -8000}, 3);
  write(file_.path(), grid);

  VdbGrid read_grid;
  std::string error;
  ASSERT_EQ(read_vdb(file_.path().string(), "", 1 << 25, read_grid, error), 0) << error;

  // The table has at most 127 x 64 x 127 entries; each voxel is in at most 8 bricks of as many nodes.
  EXPECT_LE(BrickTables(read_grid.channels[0]).bytes(),
            4u * 127 * 64 * 127 + 18 * (4 * ls::render::kBrickValues + 4 * ls::render::kNodeEntries));
  const Bricks bricks(read_grid.shape.size_of_box(), read_grid.shape.lead_of_box(),
                      std::move(read_grid.channels[0]));
  EXPECT_EQ(bricks.at(1, 1, 16001), 2);
  EXPECT_EQ(bricks.at(16001, 8001, 1), 3);
  EXPECT_EQ(bricks.at(8000, 4000, 8000), 0);

  grid->getAccessor().setValue({100'000, 0, 0}, 1);
  write(file_.path(), grid);
  EXPECT_THAT(read(file_.path()).error, HasSubstr("spans 108003 voxels along an axis; the limit is 16384"));
}

TEST_F(Vdb, LargeTilesAreNotExpanded) {
  const auto grid = filled<openvdb::FloatGrid>([](int) { return 0.f; });
  grid->clear();
  grid->tree().addTile(3, openvdb::Coord(4096, 0, -4096), 2.f, true);  // a child of the root: 4096^3 voxels
  write(file_.path(), grid);

  VdbGrid read_grid;
  std::string error;
  ASSERT_EQ(read_vdb(file_.path().string(), "", 1 << 20, read_grid, error), 0) << error;

  EXPECT_EQ(read_grid.shape.size[0], 4098);
  EXPECT_LT(BrickTables(read_grid.channels[0]).bytes(), 1u << 20);
  const Bricks bricks(read_grid.shape.size_of_box(), read_grid.shape.lead_of_box(),
                      std::move(read_grid.channels[0]));
  for (const int x : {0, 1, 4096, 4097}) EXPECT_EQ(bricks.at(x, 5, 4096), x > 0 && x < 4097 ? 2 : 0);
}

TEST_F(Vdb, HalfFloatsStayHalvesInMemory) {
  const auto grid = filled<openvdb::FloatGrid>([](int i) { return static_cast<float>(i) / 3; });
  for (const bool half : {false, true}) {
    grid->setSaveFloatAsHalf(half);
    write(file_.path(), grid);
    VdbGrid read_grid;
    std::string error;
    ASSERT_EQ(read_vdb(file_.path().string(), "", 1 << 25, read_grid, error), 0) << error;
    EXPECT_EQ(read_grid.channels[0].floats.empty(), half);
    EXPECT_EQ(read_grid.channels[0].halves.empty(), !half);
  }
}

// A leaf's values outside of the box of active voxels, enlarged by one layer, do not belong to the grid.
TEST_F(Vdb, InactiveVoxelsCountWithinTheBoxOnly) {
  const auto grid = filled<openvdb::FloatGrid>([](int) { return 0.f; });
  grid->clear();
  grid->getAccessor().setValue({2, 2, 2}, 1);
  grid->getAccessor().setValueOff({1, 2, 2}, 5);
  grid->getAccessor().setValueOff({6, 2, 2}, std::numeric_limits<float>::quiet_NaN());
  grid->getAccessor().setValueOff({6, 6, 2}, -1);
  write(file_.path(), grid, 0);

  const Read r = read(file_.path());

  ASSERT_EQ(r.error, "");
  EXPECT_EQ(r.grid.negatives, 0u);
  EXPECT_EQ(r.at(0, 1, 1), 5);
  EXPECT_EQ(r.at(2, 1, 1), 0);
}

TEST_F(Vdb, RefusesPointsAndOtherGridsByTheirTypes) {
  write(file_.path(), openvdb::GridBase::createGrid("Tree_ptdataidx32_5_4_3"));
  EXPECT_THAT(read(file_.path()).error, HasSubstr("holds points"));
  write(file_.path(), filled<openvdb::Int32Grid>([](int i) { return i; }));
  EXPECT_THAT(read(file_.path()).error, HasSubstr("has values of type int32"));
  write(file_.path(), filled<openvdb::BoolGrid>([](int) { return true; }));
  EXPECT_THAT(read(file_.path()).error, HasSubstr("has values of type bool"));
  write(file_.path(), filled<openvdb::Vec3IGrid>(three<int>));
  EXPECT_THAT(read(file_.path()).error, HasSubstr("has values of type vec3i"));
  const auto flow = filled<openvdb::Vec3SGrid>(three<float>);
  flow->setGridClass(openvdb::GRID_STAGGERED);
  write(file_.path(), flow);
  EXPECT_THAT(read(file_.path()).error, HasSubstr("is staggered"));
}

// The number of the format stands behind the magic one. What is written for a grid of numbers without Blosc
// has not changed since version 222.
TEST_F(Vdb, ReadsOlderVersionsOfTheFormat) {
  constexpr std::uint32_t kMask = openvdb::io::COMPRESS_ACTIVE_MASK, kZip = openvdb::io::COMPRESS_ZIP;
  for (const std::uint32_t compression : {std::uint32_t{0}, kMask, kMask | kZip})
    for (const std::uint32_t version : {222u, 223u, 224u}) {
      SCOPED_TRACE(version);
      write(file_.path(), filled<openvdb::FloatGrid>([](int i) { return static_cast<float>(i); }),
            compression);
      {
        std::fstream bytes(file_.path(), std::ios::in | std::ios::out | std::ios::binary);
        bytes.seekp(8);
        bytes.write(reinterpret_cast<const char*>(&version), sizeof version);
      }
      expect_them(read(file_.path()), 1);
    }
}

TEST_F(Vdb, RefusesAFormatThatIsTooOldOrTooNew) {
  for (const std::uint32_t version : {100u, 9999u}) {
    write(file_.path(), filled<openvdb::FloatGrid>([](int i) { return static_cast<float>(i); }));
    {
      std::fstream bytes(file_.path(), std::ios::in | std::ios::out | std::ios::binary);
      bytes.seekp(8);
      bytes.write(reinterpret_cast<const char*>(&version), sizeof version);
    }
    // So old a header is laid out otherwise: what is read of it is no file's either.
    EXPECT_THAT(read(file_.path()).error, HasSubstr(version == 100 ? "" : "it is of version 9999"));
    EXPECT_NE(read(file_.path()).error, "") << version;
  }
}

std::string bytes_of(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}
void store(const std::filesystem::path& path, std::string_view bytes) {
  std::ofstream(path, std::ios::binary).write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
}
std::string gzipped(std::string_view bytes) {
  z_stream z{};
  EXPECT_EQ(deflateInit2(&z, 6, Z_DEFLATED, 15 + 16, 8, Z_DEFAULT_STRATEGY), Z_OK);
  std::string out(deflateBound(&z, bytes.size()) + 32, '\0');
  z.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data()));
  z.avail_in = static_cast<uInt>(bytes.size());
  z.next_out = reinterpret_cast<Bytef*>(out.data());
  z.avail_out = static_cast<uInt>(out.size());
  EXPECT_EQ(deflate(&z, Z_FINISH), Z_STREAM_END);
  out.resize(z.total_out);
  deflateEnd(&z);
  return out;
}

constexpr std::uint32_t kMask = openvdb::io::COMPRESS_ACTIVE_MASK, kZip = openvdb::io::COMPRESS_ZIP,
                        kBlosc = openvdb::io::COMPRESS_BLOSC;

// Writes the numbers of expect_them() in each form that OpenVDB has for them, and calls `check` with the
// bytes of each file.
template <class Check>
void for_each_form(const std::filesystem::path& path, Check check) {
  for (const bool half : {false, true})
    for (const std::uint32_t compression : {0u, kMask, kZip, kMask | kZip, kBlosc, kMask | kBlosc}) {
      SCOPED_TRACE(std::to_string(compression) + (half ? " half" : " float"));
      const auto grid = filled<openvdb::FloatGrid>([](int i) { return static_cast<float>(i); });
      grid->setSaveFloatAsHalf(half);
      write(path, grid, compression);
      check(bytes_of(path));
    }
  SCOPED_TRACE("written as a stream, without offsets");
  const auto grid = filled<openvdb::FloatGrid>([](int i) { return static_cast<float>(i); });
  grid->setName("density");
  std::ostringstream out;
  openvdb::io::Stream stream(out);
  stream.setCompression(0);
  stream.write(openvdb::GridCPtrVec{grid});
  check(out.str());
}

TEST_F(Vdb, ReadsEveryFormCompletely) {
  for_each_form(file_.path(), [&](const std::string& whole) {
    store(file_.path(), whole);
    expect_them(read(file_.path()), 1);
  });
}

TEST_F(Vdb, TruncatedFileIsRefusedInEveryForm) {
  for_each_form(file_.path(), [&](const std::string& whole) {
    const std::size_t step = std::max<std::size_t>(1, whole.size() / 200);
    for (std::size_t cut = 0; cut < whole.size(); cut += step) {
      store(file_.path(), whole.substr(0, cut));
      ASSERT_NE(read(file_.path()).error, "") << "cut to " << cut << " of " << whole.size();
    }
    store(file_.path(), whole.substr(0, whole.size() - 1));
    ASSERT_THAT(read(file_.path()).error, HasSubstr("damaged, or cut short"));
  });
}

TEST_F(Vdb, GzipIsUnpackedAndDamageReported) {
  write(file_.path(), filled<openvdb::FloatGrid>([](int i) { return static_cast<float>(i); }));
  const std::string packed = gzipped(bytes_of(file_.path()));

  store(file_.path(), packed);
  expect_them(read(file_.path()), 1);
  for (std::size_t at = 0; at < packed.size(); at += packed.size() / 100 + 1) {
    store(file_.path(), packed.substr(0, at));
    EXPECT_NE(read(file_.path()).error, "") << at;
    if (at < 10) continue;  // the header of gzip has a time and other fields that mean nothing here
    std::string changed = packed;
    changed[at] = static_cast<char>(changed[at] ^ 0x10);
    store(file_.path(), changed);
    // The bits that fill up the last byte of the packed data mean nothing: then it is the whole grid.
    if (const auto changed_grid = read(file_.path()); changed_grid.error.empty())
      expect_them(changed_grid, 1);
  }
}

TEST_F(Vdb, GitLfsPointerIsReportedAsSuch) {
  store(file_.path(), "version https://git-lfs.github.com/spec/v1\noid sha256:00\nsize 12\n");

  EXPECT_THAT(read(file_.path()).error, HasSubstr("git lfs pull"));
}

TEST_F(Vdb, GridsThatShareATreeAreRead) {
  const auto one = filled<openvdb::FloatGrid>([](int i) { return static_cast<float>(i); });
  one->setName("density");
  const auto other = openvdb::gridPtrCast<openvdb::FloatGrid>(one->copyGrid());
  other->setName("other");
  for (const auto& order : {openvdb::GridPtrVec{one, other}, openvdb::GridPtrVec{other, one}}) {
    openvdb::io::File file(file_.path().string());
    file.write(order);
    file.close();
    expect_them(read(file_.path()), 1);
  }
}

}  // namespace
