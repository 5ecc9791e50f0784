// Markup, numbers and phrases.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <cstdlib>
#include <fstream>
#include <iterator>
#include <limits>

#include "tests/unit/report/shown.h"
#include "util/report/html.h"
#include "util/report/number_text.h"
#include "util/report/phrases.h"

namespace ls::report {
namespace {

std::span<const std::byte> bytes(std::string_view text) { return std::as_bytes(std::span(text)); }

TEST(EscapeHtml, LeavesNoMarkup) {
  EXPECT_EQ(escape_html("<img src=x onerror=\"a('b')\">&"),
            "&lt;img src=x onerror=&quot;a(&#39;b&#39;)&quot;&gt;&amp;");
}

TEST(EscapeHtml, RemovesDirectionMarksAndForgedCharacters) {
  EXPECT_EQ(escape_html("a\x1b[31m\x01z"), "a [31m z");
  EXPECT_EQ(escape_html("a\u202Efdp.exe"), "a fdp.exe");
}

TEST(EscapeHtml, KeepsLines) { EXPECT_EQ(escape_html("a\n<b\n"), "a\n&lt;b\n"); }

// The examples of RFC 4648, section 10.
TEST(Base64, MatchesTheStandard) {
  EXPECT_EQ(base64(bytes("")), "");
  EXPECT_EQ(base64(bytes("f")), "Zg==");
  EXPECT_EQ(base64(bytes("fo")), "Zm8=");
  EXPECT_EQ(base64(bytes("foo")), "Zm9v");
  EXPECT_EQ(base64(bytes("foob")), "Zm9vYg==");
  EXPECT_EQ(base64(bytes("fooba")), "Zm9vYmE=");
  EXPECT_EQ(base64(bytes("foobar")), "Zm9vYmFy");
  EXPECT_EQ(base64(bytes("\xff\xfe\xfd")), "//79");
}

TEST(Document, ForbidsScriptsAndAddressesAndAllowsItsStyleByDigest) {
  const std::string page = document("a <b>", "p{color:red}", "<p>x</p>");

  // The digest is from: printf 'p{color:red}' | openssl dgst -sha256 -binary | base64
  EXPECT_NE(page.find("default-src 'none'; img-src data:; style-src "
                      "'sha256-p0bF+un5yUb9MBO6xRb8kPHlY2BdpHVtLiFkDrZPF64='"),
            std::string::npos)
      << page;
  EXPECT_NE(page.find("<title>a &lt;b&gt;</title>"), std::string::npos);
  EXPECT_NE(page.find("<style>p{color:red}</style>"), std::string::npos);
}

constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

// The table is shared with the dashboard, whose texts tests/web/test_modules.py compares with it.
TEST(Words, MatchTheTable) {
  const std::pair<const char*, std::string (*)(double)> all[] = {
      {"figure", figure},        {"given", given},     {"duration", duration}, {"count", count},
      {"samples", sample_count}, {"bytes", byte_size}, {"percent", percent}};
  for (const auto& [what, words] : all)
    for (const auto& row : shown(what))
      EXPECT_EQ(words(row[0].is_null() ? kUnknown : row[0].get<double>()), row[1].get<std::string>()) << what;
}

TEST(Words, DatesAreInUtc) {
  EXPECT_EQ(date_time(1765000000), "2025-12-06 05:46 UTC");
  EXPECT_EQ(date_time(kUnknown), "–");
}

std::string module_text() {
  std::string text =
      "// Phrases that the dashboard has in common with reports and the terminal: written from "
      "util/report/phrases.h\n// by LIGHTSHAFT_UPDATE_DOCS=1 report_test --gtest_filter='Phrases.*'.\n"
      "export const phrases = {\n";
  for (const Phrase& p : kPhrases) text += fmt::format("  {}: {},\n", p.key, nlohmann::json(p.text).dump());
  return text + "};\n";
}

TEST(Phrases, DashboardAndReportsShareTheirPhrases) {
  const std::string path = LS_SOURCE_DIR "/web/static/js/phrases.js";
  if (std::getenv("LIGHTSHAFT_UPDATE_DOCS")) std::ofstream(path) << module_text();
  std::ifstream in(path);
  const std::string committed{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};

  EXPECT_EQ(committed, module_text())
      << "run LIGHTSHAFT_UPDATE_DOCS=1 report_test --gtest_filter='Phrases.*' and commit the module";
}

}  // namespace
}  // namespace ls::report
