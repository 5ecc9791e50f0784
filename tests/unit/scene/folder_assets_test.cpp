#include "common/scene/folder_assets.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

namespace ls {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

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
