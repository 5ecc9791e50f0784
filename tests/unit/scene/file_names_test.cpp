#include "common/scene/file_names.h"

#include "tests/unit/scene/scene_testing.h"

namespace ls {
namespace {

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

}  // namespace
}  // namespace ls
