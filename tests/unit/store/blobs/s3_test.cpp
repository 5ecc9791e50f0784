// Parts of the S3 blob store: addresses given to --blobs, and the choice of local copies. Signatures of
// requests are tested in tests/system/test_s3.py, where a server verifies them.
#include <gtest/gtest.h>

#include "coordinator/store/blobs/s3_blobs.h"

namespace ls::coordinator {
namespace {

TEST(S3Address, IsReadFromAUrl) {
  const auto address = parse_s3_url("s3://farm-1/scenes/v2/?endpoint=http://minio:9000/&region=eu-1");
  ASSERT_TRUE(address) << address.error().message;
  EXPECT_EQ(address->bucket, "farm-1");
  EXPECT_EQ(address->prefix, "scenes/v2");
  EXPECT_EQ(address->endpoint, "http://minio:9000");
  EXPECT_EQ(address->region, "eu-1");
  EXPECT_EQ(address->shown(), "s3://farm-1/scenes/v2 at http://minio:9000");
}

TEST(S3Address, DefaultsToAmazonsEndpointOfTheRegion) {
  const auto address = parse_s3_url("s3://farm?region=eu-central-1");
  ASSERT_TRUE(address);
  EXPECT_EQ(address->prefix, "");
  EXPECT_EQ(address->endpoint, "https://s3.eu-central-1.amazonaws.com");
}

TEST(S3Address, ReadsPartSizeAndCacheSize) {
  const auto plain = parse_s3_url("s3://farm/scenes"),
             told = parse_s3_url("s3://farm?part-mib=5&copies-mib=2048");
  ASSERT_TRUE(plain && told);
  EXPECT_EQ(plain->part_bytes, 64u << 20);
  EXPECT_EQ(plain->copies_bytes, 0u);
  EXPECT_EQ(told->part_bytes, 5u << 20);
  EXPECT_EQ(told->copies_bytes, std::uint64_t{2} << 30);
}

TEST(S3Address, InvalidAddressIsRefusedByName) {
  for (const char* url :
       {"s3:/farm", "s3://", "s3://x", "s3://farm//a", "s3://farm/a b", "s3://farm/../other",
        "s3://farm/a%2F", "s3://farm?endpoint=ftp://x", "s3://farm?endpoint=http://x\r\nHost: y",
        "s3://farm?key=secret", "s3://farm?region=a/b", "s3://farm:80", "s3://farm?part-mib=4",
        "s3://farm?part-mib=5121", "s3://farm?part-mib=-5", "s3://farm?part-mib=8x", "s3://farm?part-mib",
        "s3://farm?copies-mib=0", "s3://farm?copies-mib=99999999999999999999"}) {
    const auto address = parse_s3_url(url);
    ASSERT_FALSE(address) << url;
    EXPECT_EQ(address.error().code, Errc::invalid_argument);
    EXPECT_NE(address.error().message.find("--blobs"), std::string::npos);
  }
}

using Digests = std::vector<Digest>;
const Digest a = sha256("a"), b = sha256("b"), c = sha256("c");

TEST(LocalCopies, LeastRecentlyUsedCopyIsRemovedFirst) {
  LocalCopies copies(100);
  EXPECT_EQ(copies.used(a, 40), Digests{});
  EXPECT_EQ(copies.used(b, 60), Digests{});
  EXPECT_EQ(copies.used(a, 40), Digests{});

  EXPECT_EQ(copies.used(c, 50), Digests{b});

  EXPECT_EQ(copies.bytes(), 90u);
}

TEST(LocalCopies, SingleOversizedCopyIsKept) {
  LocalCopies copies(100);
  copies.used(a, 40);
  copies.used(b, 40);

  EXPECT_EQ(copies.used(c, 1000), (Digests{a, b}));
  EXPECT_EQ(copies.used(a, 40), Digests{c});
}

TEST(LocalCopies, CountEachCopyOnceAndNoRemovedOnes) {
  LocalCopies copies(100);
  for (int i = 0; i < 10; ++i) EXPECT_EQ(copies.used(a, 60), Digests{});
  copies.gone(a);
  copies.gone(b);

  EXPECT_EQ(copies.bytes(), 0u);
  EXPECT_EQ(copies.used(c, 100), Digests{});
}

TEST(LocalCopies, WithoutALimitAllAreKept) {
  LocalCopies copies(0);
  EXPECT_EQ(copies.used(a, 1ull << 60), Digests{});
  EXPECT_EQ(copies.used(b, 1ull << 60), Digests{});
}

}  // namespace
}  // namespace ls::coordinator
