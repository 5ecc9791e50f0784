#include <gtest/gtest.h>

#include "coordinator/store/blobs/s3_blobs.h"

namespace ls::coordinator {
namespace {

using Digests = std::vector<Digest>;
const Digest a = sha256("a"), b = sha256("b"), c = sha256("c");

TEST(LocalCopies, TheOneNotUsedForTheLongestTimeGoesFirst) {
  LocalCopies copies(100);
  EXPECT_EQ(copies.used(a, 40), Digests{});
  EXPECT_EQ(copies.used(b, 60), Digests{});
  EXPECT_EQ(copies.used(a, 40), Digests{});

  EXPECT_EQ(copies.used(c, 50), Digests{b});

  EXPECT_EQ(copies.bytes(), 90u);
}

TEST(LocalCopies, OneThatIsTooLargeByItselfStaysAlone) {
  LocalCopies copies(100);
  copies.used(a, 40);
  copies.used(b, 40);

  EXPECT_EQ(copies.used(c, 1000), (Digests{a, b}));
  EXPECT_EQ(copies.used(a, 40), Digests{c});
}

TEST(LocalCopies, CountEachOnceAndNotWhatIsGone) {
  LocalCopies copies(100);
  for (int i = 0; i < 10; ++i) EXPECT_EQ(copies.used(a, 60), Digests{});
  copies.gone(a);
  copies.gone(b);

  EXPECT_EQ(copies.bytes(), 0u);
  EXPECT_EQ(copies.used(c, 100), Digests{});
}

TEST(LocalCopies, WithoutABoundAllStay) {
  LocalCopies copies(0);
  EXPECT_EQ(copies.used(a, 1ull << 60), Digests{});
  EXPECT_EQ(copies.used(b, 1ull << 60), Digests{});
}

}  // namespace
}  // namespace ls::coordinator
