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
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

#include "worker/render/media/vdb_reply.h"

// OpenVDB frees not all of what it has read of a file that turns out to be damaged. lightshaft-vdb reads one
// file and ends, so nothing gathers; LeakSanitizer asks this function what it shall not report.
extern "C" const char* __lsan_default_suppressions();
extern "C" const char* __lsan_default_suppressions() { return "leak:libopenvdb"; }

namespace {

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
  LsVdbGrid grid{};
  std::vector<float> values;

  float at(int x, int y, int z, int channel = 0) const {
    const int node = (z * grid.size[1] + y) * grid.size[0] + x;
    return values.at(static_cast<std::size_t>(grid.channels * node + channel));
  }
};

Read read(const std::filesystem::path& path, std::uint64_t max_values = 1 << 20) {
  Read r;
  char error[512] = {};
  if (ls_vdb_read(path.c_str(), "", max_values, &r.grid, error, sizeof error) != 0) {
    r.error = error;
    return r;
  }
  const auto n = static_cast<std::size_t>(r.grid.size[0]) * r.grid.size[1] * r.grid.size[2] * r.grid.channels;
  r.values.assign(r.grid.values, r.grid.values + n);
  ls_vdb_free(&r.grid);
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

TEST_F(Vdb, LimitCountsEveryValue) {
  write(file_.path(), filled<openvdb::Vec3SGrid>(three<float>));

  EXPECT_THAT(read(file_.path(), 3 * 420 - 1).error, HasSubstr("420 voxels of 3 values; the limit is 419"));
  EXPECT_EQ(read(file_.path(), 3 * 420).error, "");
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
