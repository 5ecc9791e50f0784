#include <gtest/gtest.h>

#include <fstream>

#include "coordinator/store/disk_blobs.h"
#include "coordinator/store/files.h"
#include "coordinator/store/memory_blobs.h"
#include "tests/unit/store/temp_folder.h"

namespace ls::coordinator {
namespace {

std::span<const std::byte> bytes(std::string_view text) { return std::as_bytes(std::span(text)); }
std::string text(const std::vector<std::byte>& b) {
  return {reinterpret_cast<const char*>(b.data()), b.size()};
}
std::size_t files_under(const std::filesystem::path& folder) {
  std::size_t n = 0;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder))
    n += entry.is_regular_file();
  return n;
}

TEST(DiskBlobs, KeepsWhatWasPutAndReadsRanges) {
  TempFolder dir;
  auto blobs = DiskBlobs::open(dir.path()).value();
  const Digest name = sha256("sunlight through steam");

  ASSERT_TRUE(blobs->put(name, bytes("sunlight through steam")));

  EXPECT_TRUE(blobs->has(name));
  EXPECT_EQ(blobs->size(name).value(), 22u);
  EXPECT_EQ(text(blobs->read(name, 0, 100).value()), "sunlight through steam");
  EXPECT_EQ(text(blobs->read(name, 9, 7).value()), "through");
  EXPECT_EQ(blobs->read(name, 23, 1).error().code, Errc::invalid_argument);
  EXPECT_TRUE(DiskBlobs::open(dir.path()).value()->has(name));
}

TEST(DiskBlobs, RefusesBytesOfAnotherDigestAndLeavesNothing) {
  TempFolder dir;
  auto blobs = DiskBlobs::open(dir.path()).value();
  const Digest name = sha256("right");

  const auto put = blobs->put(name, bytes("wrong"));

  ASSERT_FALSE(put);
  EXPECT_EQ(put.error().code, Errc::invalid_argument);
  EXPECT_NE(put.error().message.find(sha256("wrong").hex()), std::string::npos);
  EXPECT_FALSE(blobs->has(name));
  EXPECT_EQ(files_under(dir.path()), 0u);
}

TEST(DiskBlobs, AnAbandonedUploadLeavesNothingAndAnUnfinishedOneIsInvisible) {
  TempFolder dir;
  auto blobs = DiskBlobs::open(dir.path()).value();
  {
    auto upload = blobs->begin_upload(sha256("abc")).value();
    ASSERT_TRUE(upload->append(bytes("ab")));
    EXPECT_FALSE(blobs->has(sha256("abc")));
    EXPECT_EQ(files_under(dir.path()), 1u);
  }
  EXPECT_EQ(files_under(dir.path()), 0u);
}

TEST(DiskBlobs, RemovesWhatAnEarlierProcessLeftHalfWritten) {
  TempFolder dir;
  ASSERT_TRUE(DiskBlobs::open(dir.path()));
  std::ofstream(dir.path() / "tmp" / "left.over") << "half";

  ASSERT_TRUE(DiskBlobs::open(dir.path()));

  EXPECT_EQ(files_under(dir.path()), 0u);
}

TEST(DiskBlobs, NamesTheMissingBlob) {
  TempFolder dir;
  auto blobs = DiskBlobs::open(dir.path()).value();
  const auto read = blobs->read(sha256("x"), 0, 1);
  EXPECT_EQ(read.error().code, Errc::not_found);
  EXPECT_NE(read.error().message.find(sha256("x").hex()), std::string::npos);
}

TEST(MemoryBlobs, ReadsAdoptedFilesInPlace) {
  TempFolder dir;
  const auto path = dir.path() / "grid.vol";
  std::ofstream(path) << "density";
  MemoryBlobs blobs;

  ASSERT_TRUE(blobs.adopt(sha256("density"), path));

  EXPECT_EQ(blobs.size(sha256("density")).value(), 7u);
  EXPECT_EQ(text(blobs.read(sha256("density"), 3, 3).value()), "sit");
  EXPECT_EQ(blobs.adopted(sha256("density")), path);
  EXPECT_FALSE(blobs.put(sha256("a"), bytes("b")));
}

TEST(DataFolder, IsLockedForOneCoordinator) {
  TempFolder dir;
  auto first = lock_folder(dir.path());
  ASSERT_TRUE(first);

  const auto second = lock_folder(dir.path());

  ASSERT_FALSE(second);
  EXPECT_EQ(second.error().code, Errc::failed_precondition);
  EXPECT_NE(second.error().message.find("another coordinator"), std::string::npos);
  *first = File();
  EXPECT_TRUE(lock_folder(dir.path()));
}

TEST(WriteAtomically, SaysThatTheDiskIsFull) {
  // /dev/full refuses every write with ENOSPC.
  auto file = File::open("/dev/full", 1 /* O_WRONLY */).value();
  const auto written = write_all(file, bytes("x"), "/dev/full");
  EXPECT_EQ(written.error().code, Errc::resource_exhausted);
  EXPECT_NE(written.error().message.find("disk is full"), std::string::npos);
}

}  // namespace
}  // namespace ls::coordinator
