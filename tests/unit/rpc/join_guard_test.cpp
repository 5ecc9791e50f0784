#include "coordinator/rpc/join_guard.h"

#include <gtest/gtest.h>

namespace ls::coordinator {
namespace {

TEST(JoinGuard, ParsesTheAddressOfAGrpcPeer) {
  EXPECT_EQ(address_of_peer("ipv4:10.0.0.7:4711"), "10.0.0.7");
  EXPECT_EQ(address_of_peer("ipv6:%5Bfd00::7%5D:4711"), "fd00::7");
  EXPECT_EQ(address_of_peer("ipv6:[fd00::7]:4711"), "fd00::7");
  EXPECT_EQ(address_of_peer("unix:/run/door"), "unix:/run/door");
  EXPECT_EQ(address_of_peer(""), "");
}

TEST(JoinGuard, AllowsEverybodyByDefault) {
  const JoinGuard none;
  none.tried("10.0.0.7", "wrong", false);
  EXPECT_EQ(none.wait("10.0.0.7", "wrong"), 0);
}

}  // namespace
}  // namespace ls::coordinator
