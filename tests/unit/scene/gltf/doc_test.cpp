#include "common/scene/gltf/doc.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <iterator>

namespace ls {
namespace {

TEST(GltfPage, IsWhatTheTableSays) {
  const std::string path = LS_SOURCE_DIR "/docs/reference/gltf.md";
  if (std::getenv("LIGHTSHAFT_UPDATE_DOCS")) std::ofstream(path) << gltf_markdown();
  std::ifstream in(path);
  const std::string committed{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};

  EXPECT_EQ(committed, gltf_markdown())
      << "run LIGHTSHAFT_UPDATE_DOCS=1 scene_test --gtest_filter='GltfPage.*' and commit the page";
}

}  // namespace
}  // namespace ls
