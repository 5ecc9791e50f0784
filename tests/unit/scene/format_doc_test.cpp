#include "common/scene/format_doc.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <iterator>

namespace ls {
namespace {

TEST(SceneFormatPage, IsWhatTheTableSays) {
  const std::string path = LS_SOURCE_DIR "/docs/scene-format.md";
  if (std::getenv("LIGHTSHAFT_UPDATE_DOCS")) std::ofstream(path) << scene_format_markdown();
  std::ifstream in(path);
  const std::string committed{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};

  EXPECT_EQ(committed, scene_format_markdown())
      << "run LIGHTSHAFT_UPDATE_DOCS=1 scene_test --gtest_filter='SceneFormatPage.*' and commit the page";
}

}  // namespace
}  // namespace ls
