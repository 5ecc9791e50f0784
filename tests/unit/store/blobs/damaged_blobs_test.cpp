// Blobs whose files no longer match their digests: they are never read, are moved aside, and are replaced
// when the right bytes arrive.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "coordinator/store/blobs/disk_blobs.h"
#include "tests/unit/store/temp_folder.h"

namespace ls::coordinator {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr std::string_view kText = "sunlight through steam";
const Digest kName = sha256(kText);

std::span<const std::byte> damaged_bytes(std::string_view text) { return std::as_bytes(std::span(text)); }

struct DamagedBlobs : ::testing::Test {
  TempFolder dir;
  std::unique_ptr<DiskBlobs> blobs = DiskBlobs::open(dir.path()).value();

  void SetUp() override { ASSERT_TRUE(blobs->put(kName, damaged_bytes(kText))); }
  // Changes one byte of the file; its size and name stay.
  void damage() const {
    std::fstream file(blobs->path(kName), std::ios::in | std::ios::out | std::ios::binary);
    file.seekp(3);
    file.put('X');
  }
  std::filesystem::path aside() const { return blobs->path(kName).string() + ".damaged"; }
  std::string read_back() const {
    const auto read = blobs->read(kName, 0, 100);
    return read ? std::string(reinterpret_cast<const char*>(read->data()), read->size())
                : read.error().message;
  }
};

TEST_F(DamagedBlobs, AreRefusedWithAnErrorThatSaysWhichAndWhatToDo) {
  damage();

  const auto read = blobs->read(kName, 0, 100);

  ASSERT_FALSE(read);
  EXPECT_EQ(read.error().code, Errc::failed_precondition);
  EXPECT_THAT(read.error().message, AllOf(HasSubstr(kName.hex()), HasSubstr(blobs->path(kName).string()),
                                          HasSubstr("damaged"), HasSubstr("upload the file again")));
}

TEST_F(DamagedBlobs, AreFoundBeforeTheirFirstPieceIsRead) {
  damage();

  EXPECT_EQ(blobs->read(kName, 10, 5).error().code, Errc::failed_precondition);
}

TEST_F(DamagedBlobs, AreFoundEvenByAProcessThatReadThemBeforeTheDamage) {
  ASSERT_TRUE(blobs->read(kName, 0, 5));
  ASSERT_TRUE(blobs->prove(kName));

  damage();

  EXPECT_EQ(blobs->read(kName, 0, 5).error().code, Errc::failed_precondition);
}

TEST_F(DamagedBlobs, AreFoundWhenAReaderComplains) {
  EXPECT_TRUE(blobs->prove(kName, true));
  damage();

  EXPECT_EQ(blobs->prove(kName, true).error().code, Errc::failed_precondition);
}

TEST_F(DamagedBlobs, CountAsMissingAndAreMovedAside) {
  damage();
  ASSERT_FALSE(blobs->prove(kName));

  EXPECT_FALSE(blobs->has(kName));
  EXPECT_FALSE(blobs->find(kName).value());
  EXPECT_EQ(blobs->prove(kName).error().code, Errc::not_found);
  EXPECT_TRUE(blobs->list(false).value().empty());
  EXPECT_TRUE(std::filesystem::exists(aside()));
}

TEST_F(DamagedBlobs, UploadRepairsThemEvenBeforeTheDamageIsDetected) {
  damage();

  ASSERT_TRUE(blobs->put(kName, damaged_bytes(kText)));

  EXPECT_EQ(read_back(), kText);
  EXPECT_FALSE(std::filesystem::exists(aside())) << "nobody needs it any more";
}

TEST_F(DamagedBlobs, AreRepairedByAnUploadInParts) {
  damage();
  ASSERT_FALSE(blobs->prove(kName));

  auto part = blobs->resume_upload(kName, 0).value();
  ASSERT_TRUE(part->append(damaged_bytes(kText)));
  ASSERT_TRUE(part->finish());

  EXPECT_EQ(read_back(), kText);
  EXPECT_FALSE(std::filesystem::exists(aside()));
}

TEST_F(DamagedBlobs, TruncatedBlobsAreFound) {
  std::filesystem::resize_file(blobs->path(kName), 5);

  EXPECT_EQ(blobs->read(kName, 0, 100).error().code, Errc::failed_precondition);
  EXPECT_FALSE(blobs->has(kName));
}

}  // namespace
}  // namespace ls::coordinator
