// Tests sequences on the command line: the options, the files that are read, and the files that are written.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "cli/farm/farm_tables.h"
#include "cli/local/local_scene.h"
#include "cli/output/output_file.h"

namespace ls::cli {
namespace {

using testing::HasSubstr;

class SequenceTest : public testing::Test {
 protected:
  void SetUp() override {
    std::string name = (std::filesystem::temp_directory_path() / "lightshaft-XXXXXX").string();
    ASSERT_NE(::mkdtemp(name.data()), nullptr);
    folder_ = name;
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }
  std::string write(const std::string& name, const std::string& text) {
    std::ofstream(folder_ / name) << text;
    return (folder_ / name).string();
  }
  std::filesystem::path folder_;
};

constexpr const char* kScene = R"(<scene version="3.0.0">
  <integrator type="path"/><sensor type="perspective"/>
  <shape type="ply"><string name="filename" value="mesh.##.ply"/></shape>
  <shape type="ply"><string name="filename" value="floor.ply"/></shape>
</scene>)";

TEST_F(SequenceTest, TheFilesOfAllFramesAreFound) {
  const std::string path = write("main.xml", kScene);
  for (const char* name : {"mesh.01.ply", "mesh.02.ply", "floor.ply"}) write(name, name);

  const auto all = SceneReader::open(path, {}, false).value().read_all({1, 2, 1});

  ASSERT_TRUE(all) << format_diagnostics(all.error().diagnostics);
  EXPECT_EQ(all->files.size(), 3u);
  EXPECT_EQ(all->files.at("mesh.02.ply").digest, sha256("mesh.02.ply"));
  EXPECT_EQ(all->frame, 1u);
}

TEST_F(SequenceTest, EveryMissingFileIsNamedWithItsFrame) {
  const std::string path = write("main.xml", kScene);
  for (const char* name : {"mesh.01.ply", "mesh.03.ply", "floor.ply"}) write(name, name);

  const auto all = SceneReader::open(path, {}, false).value().read_all({1, 4, 1});

  ASSERT_FALSE(all);
  ASSERT_EQ(all.error().diagnostics.size(), 2u) << format_diagnostics(all.error().diagnostics);
  EXPECT_THAT(all.error().diagnostics[0].text, HasSubstr("frame 2: there is no file \"mesh.02.ply\""));
  EXPECT_THAT(all.error().diagnostics[1].text, HasSubstr("frame 4: there is no file \"mesh.04.ply\""));
  EXPECT_EQ(all.error().diagnostics[1].place.line, 3);
}

TEST_F(SequenceTest, FileNameWithHashesIsRefusedWithoutFrames) {
  const auto scene = read_local_scene(write("main.xml", kScene), {}, false);
  ASSERT_FALSE(scene);
  EXPECT_THAT(scene.error().diagnostics.at(0).text, HasSubstr("--frames"));
}

TEST_F(SequenceTest, FrameFilesNeedDifferentNames) {
  const std::string one = (folder_ / "out.exr").string(), many = (folder_ / "out_##.exr").string();
  EXPECT_THAT(check_numbered("-o", one, {1, 2, 1}).error().message, HasSubstr("out_####.exr"));
  EXPECT_TRUE(check_numbered("-o", one, {2, 2, 1}));
  EXPECT_TRUE(check_outputs("-o", many, FrameRange{1, 2, 1}));
  EXPECT_TRUE(check_outputs("--report", one, FrameRange{1, 2, 1})) << "one report for all";
  std::filesystem::create_directory(folder_ / "out_02.exr");
  EXPECT_FALSE(check_outputs("-o", many, FrameRange{1, 2, 1})) << "the second one's name is a folder's";
}

TEST(SequenceTables, ShowFramesAndTheirErrors) {
  const auto job =
      nlohmann::json::parse(R"({"id": "j-1", "state": "running", "name": "s.xml", "frames": {"range": "1-2",
    "total": 2, "done": 1, "failed": 1, "cancelled": 0, "list": [{"frame": 1, "state": "done", "progress": 1},
    {"frame": 2, "state": "failed", "progress": 0.5, "error": "bad mesh"}]}})");
  EXPECT_THAT(job_text(job), testing::AllOf(HasSubstr("1-2: 1 of 2 done, 1 failed"), HasSubstr("bad mesh")));
  EXPECT_THAT(jobs_table({{"jobs", {job}}}), HasSubstr("s.xml (frames: 1 of 2 done, 1 failed)"));
}

}  // namespace
}  // namespace ls::cli
