#include "common/scene/reader/format_doc.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <iterator>

#include "tests/unit/scene/scene_testing.h"

namespace ls {
namespace {

TEST(SceneFormatPage, IsWhatTheTableSays) {
  const std::string path = LS_SOURCE_DIR "/docs/reference/scene-format.md";
  if (std::getenv("LIGHTSHAFT_UPDATE_DOCS")) std::ofstream(path) << scene_format_markdown();
  std::ifstream in(path);
  const std::string committed{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};

  EXPECT_EQ(committed, scene_format_markdown())
      << "run LIGHTSHAFT_UPDATE_DOCS=1 scene_test --gtest_filter='SceneFormatPage.*' and commit the page";
}

TEST(SceneFormatPage, ShowsASceneThatReadsWithoutComplaint) {
  const std::string page = scene_format_markdown();
  const std::size_t begin = page.find("```xml\n") + 7, end = page.find("```", begin);
  ASSERT_NE(end, std::string::npos);

  const ReadResult r = read(page.substr(begin, end - begin), {.defines = {{"density", "3"}}});

  ASSERT_TRUE(r.scene) << messages(r);
  EXPECT_TRUE(r.diagnostics.empty()) << messages(r);
  EXPECT_EQ(r.scene->media.size(), 1u);
}

}  // namespace
}  // namespace ls
