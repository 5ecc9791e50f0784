#include "coordinator/store/blobs/collected_blobs.h"

#include <gtest/gtest.h>

#include "coordinator/store/blobs/disk_blobs.h"
#include "tests/support/fake_clock.h"
#include "tests/unit/store/temp_folder.h"

namespace ls::coordinator {
namespace {

std::span<const std::byte> collected_bytes(std::string_view text) { return std::as_bytes(std::span(text)); }

struct Collection : ::testing::Test {
  TempFolder dir;
  std::shared_ptr<FakeClock> clock = std::make_shared<FakeClock>();
  std::shared_ptr<DiskBlobs> disk = DiskBlobs::open(dir.path()).value();
  CollectedBlobs blobs{disk, clock, std::chrono::hours(24)};

  Digest put(std::string_view text) {
    EXPECT_TRUE(blobs.put(sha256(text), collected_bytes(text)));
    return sha256(text);
  }
  CollectedBlobs::Swept sweep(const std::set<Digest>& needed = {}) { return blobs.sweep(needed).value(); }
};

TEST_F(Collection, RemovesUnneededBlobsAfterTheirTimeAndKeepsNeededOnes) {
  const Digest stray = put("stray"), used = put("used");

  EXPECT_EQ(sweep({used}).blobs, 0u);
  clock->advance(std::chrono::hours(24) - std::chrono::seconds(1));
  EXPECT_EQ(sweep({used}).blobs, 0u);
  clock->advance(std::chrono::seconds(1));
  EXPECT_EQ(sweep({used}).blobs, 1u);

  EXPECT_FALSE(disk->has(stray));
  EXPECT_TRUE(disk->has(used));
}

TEST_F(Collection, RemovalOfTheLastJobRestartsTheTime) {
  const Digest file = put("grid");
  sweep({file});
  clock->advance(std::chrono::hours(100));

  EXPECT_EQ(sweep().blobs, 0u);
  clock->advance(std::chrono::hours(24));
  EXPECT_EQ(sweep().blobs, 1u);
}

TEST_F(Collection, RequestForABlobRestartsItsTime) {
  const Digest file = put("grid");
  sweep();
  clock->advance(std::chrono::hours(23));
  EXPECT_TRUE(blobs.has(file));
  sweep();
  clock->advance(std::chrono::hours(23));

  EXPECT_EQ(sweep().blobs, 0u);
  EXPECT_TRUE(disk->has(file));
}

TEST_F(Collection, RemovesNothingDuringASubmission) {
  const Digest file = put("grid");
  sweep();
  clock->advance(std::chrono::hours(48));
  {
    const auto submission = blobs.in_use();
    EXPECT_EQ(sweep().blobs, 0u);
    EXPECT_TRUE(disk->has(file));
  }
  EXPECT_EQ(sweep().blobs, 1u);
}

TEST_F(Collection, RemovesUnfinishedUploadsAfterADayEvenWhereBlobsAreKeptForEver) {
  CollectedBlobs for_good{disk, clock, std::nullopt};
  const Digest stray = put("stray"), part = sha256("abc");
  ASSERT_TRUE(for_good.resume_upload(part, 0).value()->append(collected_bytes("a")));
  EXPECT_EQ(for_good.sweep({}).value().unfinished, 0u);

  clock->advance(std::chrono::hours(24));
  const auto swept = for_good.sweep({}).value();

  EXPECT_EQ(swept.unfinished, 1u);
  EXPECT_EQ(swept.blobs, 0u);
  EXPECT_EQ(disk->received(part), 0u);
  EXPECT_TRUE(disk->has(stray));
}

TEST_F(Collection, RemovesAnUnfinishedUploadThatDoesNotGrow) {
  const Digest name = sha256("abc");
  ASSERT_TRUE(blobs.resume_upload(name, 0).value()->append(collected_bytes("a")));
  sweep();
  clock->advance(std::chrono::hours(23));
  ASSERT_TRUE(blobs.resume_upload(name, 1).value()->append(collected_bytes("b")));
  EXPECT_EQ(sweep().unfinished, 0u);
  clock->advance(std::chrono::hours(23));
  EXPECT_EQ(sweep().unfinished, 0u) << "it grew an hour before";

  clock->advance(std::chrono::hours(1));

  EXPECT_EQ(sweep().unfinished, 1u);
  EXPECT_EQ(disk->received(name), 0u);
}

}  // namespace
}  // namespace ls::coordinator
