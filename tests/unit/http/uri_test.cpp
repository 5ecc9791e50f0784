#include "coordinator/http/message/message.h"

#include <gtest/gtest.h>

#include "coordinator/http/message/limits.h"

namespace ls::http {
namespace {

using Segments = std::vector<std::string>;

TEST(Uri, ParsesATarget) {
  const auto target = parse_target("/api/v1/jobs/a%20b?x=1+2&y&z=%2B=#part");

  ASSERT_TRUE(target);
  EXPECT_EQ(target->segments, (Segments{"api", "v1", "jobs", "a b"}));
  EXPECT_EQ(target->query, (Fields{{"x", "1 2"}, {"y", ""}, {"z", "+="}}));
}

TEST(Uri, AcceptsTheAbsoluteFormOfProxies) {
  EXPECT_EQ(parse_target("http://farm:8080/api?x=1")->segments, Segments{"api"});
  EXPECT_TRUE(parse_target("http://farm")->segments.empty());
}

TEST(Uri, RefusesBrokenEscapesAndHiddenSlashes) {
  for (const char* wrong :
       {"", "api", "*", "/a b", "/a\tb", "/%", "/%2", "/%zz", "/a%2fb", "/a%00b", "/a?x=%g0", "/\x7f"})
    EXPECT_FALSE(parse_target(wrong)) << wrong;
}

TEST(Uri, BoundsTheNumberOfParameters) {
  std::string target = "/?a";
  for (std::size_t i = 1; i < kMaxQueryParameters; ++i) target += "&a";
  EXPECT_TRUE(parse_target(target));
  EXPECT_FALSE(parse_target(target + "&a"));
}

TEST(Uri, KeepsDots) {
  EXPECT_EQ(parse_target("/a/../b//c/")->segments, (Segments{"a", "..", "b", "", "c"}));
}

}  // namespace
}  // namespace ls::http
