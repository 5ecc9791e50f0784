// Who answers for a worker: its address and its certificate.
#include "coordinator/rpc/principal.h"

#include <gtest/gtest.h>

namespace ls::coordinator {
namespace {

TEST(Principal, IgnoresThePort) {
  EXPECT_EQ(principal_of("ipv4:10.0.0.7:4711", ""), "10.0.0.7");
  EXPECT_EQ(principal_of("ipv4:10.0.0.7:4712", ""), principal_of("ipv4:10.0.0.7:4711", ""));
  EXPECT_NE(principal_of("ipv4:10.0.0.8:4711", ""), principal_of("ipv4:10.0.0.7:4711", ""));
}

TEST(Principal, IsTheNetworkOfAnIpv6Address) {
  const std::string one = principal_of("ipv6:%5B2001:db8:1:2:3::4%5D:4711", "");

  EXPECT_EQ(one, "2001:db8:1:2::/64");
  EXPECT_EQ(principal_of("ipv6:[2001:db8:1:2:ffff::9]:80", ""), one);
  EXPECT_NE(principal_of("ipv6:[2001:db8:1:3::4]:80", ""), one);
}

TEST(Principal, EachLocalConnectionIsAPrincipal) {
  EXPECT_NE(principal_of("ipv4:127.0.0.1:1", ""), principal_of("ipv4:127.0.0.1:2", ""));
  EXPECT_NE(principal_of("ipv6:%5B::1%5D:1", ""), principal_of("ipv6:%5B::1%5D:2", ""));
}

TEST(Principal, DiffersByCertificate) {
  const std::string peer = "ipv4:10.0.0.7:4711";

  EXPECT_NE(principal_of(peer, "one"), principal_of(peer, "two"));
  EXPECT_NE(principal_of(peer, "one"), principal_of(peer, ""));
  EXPECT_EQ(principal_of(peer, "one"), principal_of("ipv4:10.0.0.7:1", "one"));
}

}  // namespace
}  // namespace ls::coordinator
