#include "tests/unit/scene/pages/pages.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <iterator>

#include "tests/unit/scene/scene_testing.h"

namespace ls::scene {
namespace {

void expect_committed(const std::string& page, const std::string& text) {
  const std::string path = LS_SOURCE_DIR "/docs/reference/" + page;
  if (std::getenv("LIGHTSHAFT_UPDATE_DOCS")) std::ofstream(path) << text;
  std::ifstream in(path);
  const std::string committed{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
  EXPECT_EQ(committed, text)
      << "run LIGHTSHAFT_UPDATE_DOCS=1 scene_test --gtest_filter='*Page.*' and commit the page";
}

TEST(SceneFormatPage, MatchesTheTable) { expect_committed("scene-format.md", scene_format_markdown()); }
TEST(MitsubaPage, MatchesTheTable) { expect_committed("mitsuba.md", mitsuba_markdown()); }
TEST(PbrtPage, MatchesTheTable) { expect_committed("pbrt.md", pbrt_markdown()); }
TEST(GltfPage, MatchesTheTable) { expect_committed("gltf.md", gltf_markdown()); }

TEST(SceneFormatPage, ExampleSceneReadsWithoutDiagnostics) {
  const std::string page = scene_format_markdown();
  const std::size_t begin = page.find("```xml\n") + 7, end = page.find("```", begin);
  ASSERT_NE(end, std::string::npos);

  const ReadResult r = read(page.substr(begin, end - begin), {.defines = {{"density", "3"}}});

  ASSERT_TRUE(r.scene) << messages(r);
  EXPECT_TRUE(r.diagnostics.empty()) << messages(r);
  EXPECT_EQ(r.scene->media.size(), 1u);
}

}  // namespace
}  // namespace ls::scene
