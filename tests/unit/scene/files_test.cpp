// The names of scene files, and the files of a scene on disk.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "common/scene/file_names.h"
#include "common/scene/folder_assets.h"
#include "tests/unit/scene/scene_testing.h"

namespace ls {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

std::string told_of(std::string_view file_name) {
  MemoryAssets assets;
  const ReadResult r = read_scene(file_name, "PXR-USDC", assets);
  EXPECT_FALSE(r.scene);
  return messages(r);
}

TEST(FileNames, OfOtherProgramsSayWhatToDo) {
  EXPECT_NE(told_of("a b/shot.USDZ").find("python3 -m lightshaft.usd 'a b/shot.USDZ' -o shot-scene"),
            std::string::npos)
      << told_of("a b/shot.USDZ");
  for (const auto& [name, want] :
       {std::pair{"x/cow.obj",
                  "a mesh alone has neither light nor camera: name it in a scene, by <shape "
                  "type=\"obj\"><string name=\"filename\" value=\"cow.obj\"/></shape>"},
        {"cow.ply", "<shape type=\"ply\">"},
        {"a.blend", "with Lightshaft's add-on"},
        {"a.abc", "export the scene as glTF 2.0"},
        {"a.FBX", "export the scene as glTF 2.0"},
        {"smoke.vdb", "a grid alone"},
        {"a.exr", "an image, not a scene"}})
    EXPECT_NE(told_of(name).find(want), std::string::npos) << told_of(name);
}

// The Python package converts a USD stage to XML, and sends the XML under the stage's name.
TEST(FileNames, OfOtherProgramsMayBeThoseOfScenes) {
  MemoryAssets assets;
  const ReadResult r = read_scene("shot.usda", "<?xml version=\"1.0\"?>\n<scene version=\"3.0.0\"/>", assets);

  EXPECT_EQ(messages(r).find("USD"), std::string::npos) << messages(r);
}

TEST(FileNames, OfScenesSayNothing) {
  for (const char* name : {"", "scene", "scene.xml", "usd", "scene.usd.xml", "a.gltf", "a.glb", "a.pbrt"})
    EXPECT_EQ(scene::why_no_scene(name), "") << name;
}

TEST(FileNames, EndInUpperOrLowerCase) {
  EXPECT_TRUE(scene::has_ending("A.GlTf", {".glb", ".gltf"}));
  EXPECT_FALSE(scene::has_ending("gltf", {".gltf"}));
  EXPECT_FALSE(scene::has_ending("", {".gltf"}));
}

class Folder : public ::testing::Test {
 protected:
  Folder() {
    fs::create_directories(path_ / "sub");
    write("cloud.vol", "volume");
    write("sub/base.xml", "<scene/>");
  }
  ~Folder() override { fs::remove_all(path_); }
  void write(const std::string& name, const std::string& text) { std::ofstream(path_ / name) << text; }

  fs::path path_ = fs::temp_directory_path() / ("lightshaft-assets-" + std::to_string(::getpid()));
  FolderAssets assets_{path_};
};

TEST_F(Folder, FindsFilesBesideTheScene) {
  const auto asset = assets_.find("cloud.vol");
  ASSERT_TRUE(asset) << asset.error().message;
  EXPECT_EQ(*asset, (Asset{"cloud.vol", sha256("volume"), 6}));
  EXPECT_EQ(assets_.path_of("cloud.vol"), path_ / "cloud.vol");
  EXPECT_EQ(assets_.path_of(sha256("volume")), path_ / "cloud.vol");
  EXPECT_EQ(assets_.text("sub/base.xml").value(), "<scene/>");
}

TEST_F(Folder, ReadsAFileOnce) {
  ASSERT_TRUE(assets_.find("cloud.vol"));
  write("cloud.vol", "changed since");
  EXPECT_EQ(assets_.find("cloud.vol")->digest, sha256("volume"));
}

TEST_F(Folder, AMissingFileIsToldWithNamesLikeIt) {
  EXPECT_EQ(assets_.find("clod.vol").error(),
            (Error{Errc::not_found, "there is no file \"clod.vol\"; did you mean 'cloud.vol'?"}));
  EXPECT_THAT(assets_.find("nowhere/cloud.vol").error().message, HasSubstr("its folder does not exist"));
}

TEST_F(Folder, AFolderIsNoFile) {
  EXPECT_EQ(assets_.find("sub").error().code, Errc::invalid_argument);
  EXPECT_EQ(assets_.text("sub").error().code, Errc::invalid_argument);
  EXPECT_EQ(assets_.find("").error().code, Errc::invalid_argument);
}

}  // namespace
}  // namespace ls
