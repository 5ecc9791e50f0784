// The names of scene files, the files of a scene on disk, and scene files that were cut short.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "formats/file_names.h"
#include "formats/folder_assets.h"
#include "tests/unit/scene/pbrt/pbrt_testing.h"
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

TEST(FileNames, ForeignSuffixesGetAdvice) {
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
TEST(FileNames, ForeignSuffixMayStillBeAScene) {
  MemoryAssets assets;
  const ReadResult r = read_scene("shot.usda", "<?xml version=\"1.0\"?>\n<scene version=\"3.0.0\"/>", assets);

  EXPECT_EQ(messages(r).find("USD"), std::string::npos) << messages(r);
}

TEST(FileNames, SceneSuffixesGetNoAdvice) {
  for (const char* name : {"", "scene", "scene.xml", "usd", "scene.usd.xml", "a.gltf", "a.glb", "a.pbrt"})
    EXPECT_EQ(scene::why_no_scene(name), "") << name;
}

TEST(FileNames, SuffixesIgnoreCase) {
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

TEST_F(Folder, MissingFileIsReportedWithSimilarNames) {
  EXPECT_EQ(assets_.find("clod.vol").error(),
            (Error{Errc::not_found, "there is no file \"clod.vol\"; did you mean 'cloud.vol'?"}));
  EXPECT_THAT(assets_.find("nowhere/cloud.vol").error().message, HasSubstr("its folder does not exist"));
}

TEST_F(Folder, NamesMayHaveBackslashesBetweenFolders) {
  EXPECT_EQ(assets_.text("sub\\base.xml").value(), "<scene/>");
  EXPECT_EQ(assets_.find(".\\cloud.vol")->digest, sha256("volume"));
  EXPECT_THAT(assets_.find("sub\\bse.xml").error().message,
              HasSubstr("did you mean 'base.xml'?; write / between folders, not \\"));
  write("a\\b.vol", "of this very name");
  EXPECT_EQ(assets_.find("a\\b.vol")->digest, sha256("of this very name"));
}

// macOS stores letters and their accents apart.
TEST_F(Folder, AccentsMayBeDecomposed) {
  fs::create_directories(path_ / "man\u0303ana");
  write("man\u0303ana/e\u0301te\u0301.vol", "apart");
  write("\u00e9t\u00e9.vol", "composed");

  EXPECT_EQ(assets_.find("ma\u00f1ana/\u00e9t\u00e9.vol")->digest, sha256("apart"));
  EXPECT_EQ(assets_.find("e\u0301te\u0301.vol")->digest, sha256("composed"));
  EXPECT_FALSE(assets_.find("e\u0300te\u0301.vol"));  // another accent
}

TEST_F(Folder, DanglingLinkIsReportedAsSuch) {
  fs::create_symlink("gone.vol", path_ / "link.vol");

  EXPECT_EQ(assets_.find("link.vol").error().message,
            "\"link.vol\" is a link to \"gone.vol\", where there is no file");
}

TEST_F(Folder, GitLfsPointerIsReportedAsSuch) {
  write("mesh.ply", "version https://git-lfs.github.com/spec/v1\noid sha256:12\nsize 3\n");

  EXPECT_THAT(assets_.find("mesh.ply").error().message, HasSubstr("\"mesh.ply\" is a pointer of Git LFS"));
  EXPECT_THAT(assets_.text("mesh.ply").error().message, HasSubstr("git lfs pull"));
}

TEST_F(Folder, TextPackedByGzipIsUnpackedButKeepsItsDigest) {
  // `printf '<scene/>' | gzip -n`
  const std::string packed(
      "\x1f\x8b\x08\x00\x00\x00\x00\x00\x00\x03\xb3\x29\x4e\x4e\xcd\x4b\xd5\xb7\x03"
      "\x00\x19\x7a\xea\xf3\x08\x00\x00\x00",
      28);
  write("more.xml.gz", packed);

  EXPECT_EQ(assets_.text("more.xml.gz").value(), "<scene/>");
  EXPECT_EQ(assets_.find("more.xml.gz")->digest, sha256(packed));
  write("cut.xml.gz", packed.substr(0, 20));
  EXPECT_THAT(assets_.text("cut.xml.gz").error().message,
              HasSubstr("'cut.xml.gz': is packed by gzip, and damaged"));
}

TEST_F(Folder, TextFileWithoutALineEndCausesAWarning) {
  write("whole.obj", "v 0 0 0\nf 1 1 1\n");
  write("cut.obj", "v 0 0 0\nf 1 1 1");
  write("cut.ply", "ply\nformat ascii 1.0\nelement");
  write("binary.ply", "ply\nformat binary_little_endian 1.0\n...x");
  for (const char* name : {"whole.obj", "cut.obj", "cut.ply", "binary.ply", "cloud.vol"})
    ASSERT_TRUE(assets_.find(name));

  const auto doubts = assets_.take_doubts();

  ASSERT_EQ(doubts.size(), 2u);
  EXPECT_THAT(doubts.find("cut.obj")->second, HasSubstr("ends within a line"));
  EXPECT_TRUE(doubts.contains("cut.ply"));
  EXPECT_TRUE(assets_.take_doubts().empty());
}

TEST_F(Folder, FolderIsNotReadAsAFile) {
  EXPECT_EQ(assets_.find("sub").error().code, Errc::invalid_argument);
  EXPECT_EQ(assets_.text("sub").error().code, Errc::invalid_argument);
  EXPECT_EQ(assets_.find("").error().code, Errc::invalid_argument);
}

// ---- scene files that were cut short ----

constexpr std::size_t kTries = 200;

// Reads the file cut at kTries places. Returns at how many of them it was read although it ended within a
// line or became another scene; a cut that only loses blanks at the end loses nothing.
std::size_t unnoticed(std::string_view name, const std::string& whole, const KeepingAssets& files) {
  KeepingAssets assets = files;
  const ReadResult right = read_scene(name, whole, assets);
  EXPECT_TRUE(right.scene) << messages(right);
  if (!right.scene) return kTries;
  std::size_t count = 0;
  for (std::size_t i = 0; i < kTries; ++i) {
    KeepingAssets again = files;
    const ReadResult r = read_scene(name, whole.substr(0, whole.size() * i / kTries), again);
    if (!r.scene) {
      EXPECT_FALSE(r.diagnostics.empty());
    } else {
      count += digest_of(*r.scene) != digest_of(*right.scene);
    }
  }
  return count;
}

TEST(DamagedScenes, TruncatedXmlIsRefused) { EXPECT_EQ(unnoticed("a.xml", kExample, {}), 0u); }

// Within a directive a cut is found; between two of them nothing tells that more should follow.
TEST(DamagedScenes, TruncatedPbrtIsRefusedUnlessADirectiveEndsThere) {
  std::string world;
  for (int i = 0; i < 20; ++i)
    world += fmt::format("AttributeBegin\n  Shape \"sphere\" \"float radius\" {}\nAttributeEnd\n", i + 1);
  const std::string whole = pbrt_scene(world);
  const std::size_t first = whole.find("WorldBegin");
  for (std::size_t at = first; at < whole.size(); ++at) {
    const ReadResult r = read_pbrt(whole.substr(0, at));
    if (!r.scene) continue;
    const std::string before = whole.substr(0, at);
    const bool between =
        before.ends_with("\n") || before.ends_with("WorldBegin") || before.ends_with("AttributeEnd");
    EXPECT_TRUE(between) << before.substr(before.rfind('\n') + 1);
  }
}

}  // namespace
}  // namespace ls
