#include <gtest/gtest.h>

#include <fstream>

#include "coordinator/base/limits.h"
#include "coordinator/store/blobs/disk_blobs.h"
#include "coordinator/store/blobs/memory_blobs.h"
#include "coordinator/store/files.h"
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

TEST(DiskBlobs, StoresBlobsAndReadsRanges) {
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

TEST(DiskBlobs, AbandonedUploadLeavesNothingAndUnfinishedUploadIsInvisible) {
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

TEST(DiskBlobs, RemovesHalfWrittenFilesOfAnEarlierProcess) {
  TempFolder dir;
  ASSERT_TRUE(DiskBlobs::open(dir.path()));
  std::ofstream(dir.path() / "tmp" / "left.over") << "half";

  ASSERT_TRUE(DiskBlobs::open(dir.path()));

  EXPECT_EQ(files_under(dir.path()), 0u);
}

TEST(DiskBlobs, ContinuesAnUploadInPartsAfterARestart) {
  TempFolder dir;
  const Digest name = sha256("sunlight through steam");
  {
    auto blobs = DiskBlobs::open(dir.path()).value();
    auto part = blobs->resume_upload(name, 0).value();
    ASSERT_TRUE(part->append(bytes("sunlight ")));
  }
  auto blobs = DiskBlobs::open(dir.path()).value();
  EXPECT_EQ(blobs->received(name), 9u);
  EXPECT_FALSE(blobs->has(name));
  EXPECT_EQ(blobs->resume_upload(name, 8).error().code, Errc::failed_precondition);

  auto part = blobs->resume_upload(name, 9).value();
  ASSERT_TRUE(part->append(bytes("through steam")));
  ASSERT_TRUE(part->finish());

  EXPECT_EQ(text(blobs->read(name, 0, 100).value()), "sunlight through steam");
  EXPECT_EQ(blobs->received(name), 0u);
  EXPECT_EQ(files_under(dir.path()), 1u);
}

TEST(DiskBlobs, DiscardsPartsWithAWrongDigest) {
  TempFolder dir;
  auto blobs = DiskBlobs::open(dir.path()).value();
  ASSERT_TRUE(blobs->resume_upload(sha256("abc"), 0).value()->append(bytes("ab")));
  auto part = blobs->resume_upload(sha256("abc"), 2).value();
  ASSERT_TRUE(part->append(bytes("d")));

  const auto done = part->finish();

  ASSERT_FALSE(done);
  EXPECT_EQ(done.error().code, Errc::invalid_argument);
  EXPECT_EQ(files_under(dir.path()), 0u);
}

TEST(DiskBlobs, RefusesBytesFromAConnectionThatAnotherHasReplaced) {
  TempFolder dir;
  auto blobs = DiskBlobs::open(dir.path()).value();
  auto half_open = blobs->resume_upload(sha256("abc"), 0).value();
  ASSERT_TRUE(half_open->append(bytes("ab")));

  auto fresh = blobs->resume_upload(sha256("abc"), 2).value();

  EXPECT_EQ(half_open->append(bytes("c")).error().code, Errc::failed_precondition);
  EXPECT_FALSE(half_open->finish());
  ASSERT_TRUE(fresh->append(bytes("c")));
  EXPECT_TRUE(fresh->finish());
  EXPECT_TRUE(blobs->has(sha256("abc")));
}

TEST(DiskBlobs, OldestUnfinishedUploadIsDroppedIfThereAreTooMany) {
  const TempFolder dir;
  const auto blobs = DiskBlobs::open(dir.path()).value();
  const auto part = [&](std::size_t i) { return sha256("part " + std::to_string(i)); };
  for (std::size_t i = 0; i < limits::kMaxUnfinishedUploads; ++i)
    ASSERT_TRUE(blobs->resume_upload(part(i), 0).value()->append(std::as_bytes(std::span("x", 1))));
  std::filesystem::last_write_time(dir.path() / "unfinished" / part(7).hex(),
                                   std::filesystem::file_time_type::clock::now() - std::chrono::hours(1));

  const auto next = blobs->resume_upload(part(5000), 0);

  ASSERT_TRUE(next) << next.error().message;
  ASSERT_TRUE((*next)->append(std::as_bytes(std::span("x", 1))));
  EXPECT_EQ(blobs->received(part(7)), 0u);
  EXPECT_EQ(blobs->received(part(8)), 1u);
  EXPECT_EQ(blobs->list(true).value().size(), limits::kMaxUnfinishedUploads);
}

// The folder of the blob is a symbolic link to itself, since root may read any folder.
TEST(DiskBlobs, UnreadableDiskIsAnErrorNotAMissingBlob) {
  const TempFolder dir;
  const auto blobs = DiskBlobs::open(dir.path()).value();
  const Digest digest = sha256("a blob");
  EXPECT_EQ(blobs->find(digest), Result<bool>(false));
  const auto group = dir.path() / digest.hex().substr(0, 2);
  std::filesystem::create_symlink(group, group);  // access() then fails with ELOOP

  const auto found = blobs->find(digest);

  ASSERT_FALSE(found);
  EXPECT_EQ(found.error().code, Errc::unavailable);
}

TEST(DiskBlobs, ListsAndRemovesBlobsAndUnfinishedOnes) {
  TempFolder dir;
  auto blobs = DiskBlobs::open(dir.path()).value();
  ASSERT_TRUE(blobs->put(sha256("a"), bytes("a")));
  auto part = blobs->resume_upload(sha256("bc"), 0).value();
  ASSERT_TRUE(part->append(bytes("b")));

  EXPECT_EQ(blobs->list(false).value(), std::vector{sha256("a")});
  EXPECT_EQ(blobs->list(true).value(), std::vector{sha256("bc")});
  blobs->remove_unfinished(sha256("bc"));
  EXPECT_FALSE(part->append(bytes("c")));
  ASSERT_TRUE(blobs->remove(sha256("a")));
  ASSERT_TRUE(blobs->remove(sha256("a")));

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

TEST(WriteAtomically, ReportsAFullDisk) {
  // /dev/full refuses every write with ENOSPC.
  auto file = File::open("/dev/full", 1 /* O_WRONLY */).value();
  const auto written = write_all(file, bytes("x"), "/dev/full");
  EXPECT_EQ(written.error().code, Errc::resource_exhausted);
  EXPECT_NE(written.error().message.find("disk is full"), std::string::npos);
}

}  // namespace
}  // namespace ls::coordinator
