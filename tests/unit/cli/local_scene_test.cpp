#include "cli/local/local_scene.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

namespace ls::cli {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

class LocalSceneTest : public testing::Test {
 protected:
  LocalSceneTest()
      : folder_(fs::path(testing::TempDir()) /
                testing::UnitTest::GetInstance()->current_test_info()->name()) {
    fs::create_directories(folder_);
  }
  ~LocalSceneTest() override { fs::remove_all(folder_); }
  std::string write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name, std::ios::binary) << text;
    return (folder_ / name).string();
  }
  fs::path folder_;
};

constexpr const char* kMain = R"(<scene version="3.0.0">
  <integrator type="path"/>
  <sensor type="perspective"/>
  <include filename="light.xml"/>
</scene>)";
constexpr const char* kLight =
    R"(<scene version="3.0.0"><emitter type="constant"><rgb name="radiance" value="$power"/></emitter></scene>)";

TEST_F(LocalSceneTest, NamesEveryFileThatTheSceneNeeds) {
  const std::string path = write("main.xml", kMain);
  write("light.xml", kLight);

  const auto scene = read_local_scene(path, {{"power", "2"}}, false);

  ASSERT_TRUE(scene) << format_diagnostics(scene.error().diagnostics);
  ASSERT_EQ(scene->files.count("light.xml"), 1u);
  EXPECT_EQ(scene->files.at("light.xml").digest, sha256(kLight));
  EXPECT_EQ(submit_request(*scene, {}).assets.at("light.xml"), sha256(kLight));
  EXPECT_EQ(scene->name, path);
}

TEST_F(LocalSceneTest, RefusesAnUnusedDefine) {
  const std::string path = write("main.xml", kMain);
  write("light.xml", kLight);

  const auto scene = read_local_scene(path, {{"power", "2"}, {"pwoer", "3"}}, false);

  ASSERT_FALSE(scene);
  EXPECT_THAT(scene.error().diagnostics.at(0).text, testing::AllOf(HasSubstr("$pwoer"), HasSubstr("$power")));
}

TEST_F(LocalSceneTest, ReportsErrorsOfTheFileItself) {
  for (const auto& [path, text] : {std::pair((folder_ / "none.xml").string(), "no such file"),
                                   std::pair(folder_.string(), "regular file")}) {
    const auto scene = read_local_scene(path, {}, false);
    ASSERT_FALSE(scene);
    EXPECT_EQ(scene.error().diagnostics.at(0).place.file, path);
    EXPECT_THAT(scene.error().diagnostics.at(0).text, HasSubstr(text));
  }
}

}  // namespace
}  // namespace ls::cli
