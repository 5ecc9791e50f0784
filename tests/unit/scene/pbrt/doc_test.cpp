#include "common/scene/pbrt/doc.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <iterator>

namespace ls {
namespace {

TEST(PbrtPage, IsWhatTheTableSays) {
  const std::string path = LS_SOURCE_DIR "/docs/reference/pbrt.md";
  if (std::getenv("LIGHTSHAFT_UPDATE_DOCS")) std::ofstream(path) << pbrt_markdown();
  std::ifstream in(path);
  const std::string committed{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};

  EXPECT_EQ(committed, pbrt_markdown())
      << "run LIGHTSHAFT_UPDATE_DOCS=1 scene_test --gtest_filter='PbrtPage.*' and commit the page";
}

}  // namespace
}  // namespace ls
