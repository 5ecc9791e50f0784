#include "common/report/phrases.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>

namespace ls::report {
namespace {

std::string module_text() {
  std::string text =
      "// Phrases that the dashboard has in common with reports and the terminal: written from "
      "common/report/phrases.h\n// by LIGHTSHAFT_UPDATE_DOCS=1 report_test --gtest_filter='Phrases.*'.\n"
      "export const phrases = {\n";
  for (const Phrase& p : kPhrases) text += fmt::format("  {}: {},\n", p.key, nlohmann::json(p.text).dump());
  return text + "};\n";
}

TEST(Phrases, OfTheDashboardAreThoseOfTheReports) {
  const std::string path = LS_SOURCE_DIR "/web/static/js/phrases.js";
  if (std::getenv("LIGHTSHAFT_UPDATE_DOCS")) std::ofstream(path) << module_text();
  std::ifstream in(path);
  const std::string committed{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};

  EXPECT_EQ(committed, module_text())
      << "run LIGHTSHAFT_UPDATE_DOCS=1 report_test --gtest_filter='Phrases.*' and commit the module";
}

}  // namespace
}  // namespace ls::report
