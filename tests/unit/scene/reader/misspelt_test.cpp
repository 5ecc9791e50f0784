// A misspelt name anywhere in a scene is an error in its line.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "core/scene/diagnostic.h"
#include "tests/unit/scene/scene_testing.h"

namespace ls {
namespace {

using ::testing::HasSubstr;

// No misspelt name is ignored: a letter added to any name of the example gives an error in that line.
TEST(Misspelt, MisspeltNameIsAnErrorInItsLine) {
  int tried = 0;
  for (const std::string key : {"name=\"", "type=\"", "<", " id=\""}) {
    for (std::size_t at = kExample.find(key); at != std::string::npos; at = kExample.find(key, at + 1)) {
      const std::size_t name = at + key.size();
      if (kExample[name] == '/') continue;
      // Definitions of ids and of parameters are skipped: any name is valid there, and only their use fails.
      if (key == " id=\"" && kExample.rfind("<ref", at) != kExample.rfind('<', at)) continue;
      if (kExample.compare(kExample.rfind('<', at), 8, "<default") == 0 && key == "name=\"") continue;
      std::string text = kExample;
      std::size_t end = name;
      while (std::isalnum(static_cast<unsigned char>(text[end])) || text[end] == '_') ++end;
      text.insert(end, "q");
      const int line =
          static_cast<int>(std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(name), '\n')) +
          1;
      const auto r = read(text);
      ++tried;
      EXPECT_FALSE(r.scene) << text.substr(at, 30);
      // A misspelt start tag makes the XML malformed, which is reported at the end tag.
      if (key != "<") {
        EXPECT_TRUE(std::any_of(r.diagnostics.begin(), r.diagnostics.end(),
                                [&](const Diagnostic& d) { return d.place.line == line; }))
            << text.substr(at, 30) << "\n"
            << messages(r);
      }
      for (const Diagnostic& d : r.diagnostics) EXPECT_GT(d.place.line, 0);
    }
  }
  EXPECT_GT(tried, 200);
}

// Adds an unknown parameter to each object of the example in turn.
TEST(Misspelt, UnknownParameterIsAnErrorInItsLine) {
  int tried = 0;
  for (std::size_t at = kExample.find("type=\""); at != std::string::npos;
       at = kExample.find("type=\"", at + 1)) {
    const std::size_t close = kExample.find('>', at);
    const bool empty = kExample[close - 1] == '/';
    const std::size_t tag = kExample.rfind('<', at) + 1;
    const std::string name = kExample.substr(tag, kExample.find(' ', tag) - tag);
    const std::string wrong = "\n<float name=\"zzyzx\" value=\"1\"/>";
    std::string text = kExample;
    text.replace(empty ? close - 1 : close, empty ? 2 : 1,
                 empty ? ">" + wrong + "</" + name + ">" : ">" + wrong);
    const int line =
        static_cast<int>(std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(close), '\n')) +
        2;
    const auto r = read(text);
    ++tried;
    ASSERT_FALSE(r.diagnostics.empty()) << text.substr(at, 30);
    EXPECT_EQ(r.diagnostics[0].place, (SourcePlace{"test.xml", line, 14})) << messages(r);
    EXPECT_THAT(r.diagnostics[0].text, HasSubstr("'zzyzx'"));
  }
  EXPECT_GT(tried, 25);
}

}  // namespace
}  // namespace ls
