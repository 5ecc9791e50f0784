#include "common/report/html.h"

#include <gtest/gtest.h>

namespace ls::report {
namespace {

std::span<const std::byte> bytes(std::string_view text) { return std::as_bytes(std::span(text)); }

TEST(EscapeHtml, LeavesNoMarkup) {
  EXPECT_EQ(escape_html("<img src=x onerror=\"a('b')\">&"),
            "&lt;img src=x onerror=&quot;a(&#39;b&#39;)&quot;&gt;&amp;");
}

TEST(EscapeHtml, LeavesNothingThatForgesOrTurnsLettersRound) {
  EXPECT_EQ(escape_html("a\x1b[31m\x01z"), "a [31m z");
  EXPECT_EQ(escape_html("a\u202Efdp.exe"), "a fdp.exe");
}

TEST(EscapeHtml, KeepsLines) { EXPECT_EQ(escape_html("a\n<b\n"), "a\n&lt;b\n"); }

// The examples of RFC 4648, section 10.
TEST(Base64, IsThatOfTheStandard) {
  EXPECT_EQ(base64(bytes("")), "");
  EXPECT_EQ(base64(bytes("f")), "Zg==");
  EXPECT_EQ(base64(bytes("fo")), "Zm8=");
  EXPECT_EQ(base64(bytes("foo")), "Zm9v");
  EXPECT_EQ(base64(bytes("foob")), "Zm9vYg==");
  EXPECT_EQ(base64(bytes("fooba")), "Zm9vYmE=");
  EXPECT_EQ(base64(bytes("foobar")), "Zm9vYmFy");
  EXPECT_EQ(base64(bytes("\xff\xfe\xfd")), "//79");
}

TEST(Document, ForbidsScriptsAndAddressesAndAllowsItsOwnStyleByDigest) {
  const std::string page = document("a <b>", "p{color:red}", "<p>x</p>");

  // The digest is from: printf 'p{color:red}' | openssl dgst -sha256 -binary | base64
  EXPECT_NE(page.find("default-src 'none'; img-src data:; style-src "
                      "'sha256-p0bF+un5yUb9MBO6xRb8kPHlY2BdpHVtLiFkDrZPF64='"),
            std::string::npos)
      << page;
  EXPECT_NE(page.find("<title>a &lt;b&gt;</title>"), std::string::npos);
  EXPECT_NE(page.find("<style>p{color:red}</style>"), std::string::npos);
}

}  // namespace
}  // namespace ls::report
