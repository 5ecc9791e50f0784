#include <gtest/gtest.h>

#include "coordinator/tls/tls_files.h"

namespace ls::tls {
namespace {

constexpr unsigned kRoot = 0, kUs = 10001, kOther = 1000;

TEST(KeyFiles, RefusesKeysThatOthersMayRead) {
  EXPECT_TRUE(kept_secret(kUs, 0100600, kUs));
  EXPECT_TRUE(kept_secret(kUs, 0100400, kUs));
  for (const unsigned mode : {0100640u, 0100604u, 0100660u, 0100644u})
    EXPECT_FALSE(kept_secret(kUs, mode, kUs));
  EXPECT_FALSE(kept_secret(kOther, 0100640, kUs));
}

// A cluster mounts a secret as root's file that is readable by a group of the process.
TEST(KeyFiles, RootOwnedFileMayBeReadableByItsGroup) {
  EXPECT_TRUE(kept_secret(kRoot, 0100440, kUs));
  EXPECT_TRUE(kept_secret(kRoot, 0100640, kUs));
  EXPECT_FALSE(kept_secret(kRoot, 0100660, kUs)) << "the group may write";
  EXPECT_FALSE(kept_secret(kRoot, 0100444, kUs)) << "everybody may read";
  EXPECT_FALSE(kept_secret(kRoot, 0100640, kRoot)) << "root needs no group";
}

}  // namespace
}  // namespace ls::tls
