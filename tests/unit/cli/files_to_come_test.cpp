#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "cli/output/files_to_come.h"

namespace ls::cli {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

// Files by name, and a clock that the tests set.
struct Disk {
  std::map<std::string, FileState> files;
  double now = 0;
  std::vector<std::string> look(FilesToCome& to_come, double seconds) {
    now += seconds;
    return to_come.look(now, [&](const std::string& path) -> std::optional<FileState> {
      const auto found = files.find(path);
      return found == files.end() ? std::nullopt : std::optional(found->second);
    });
  }
};

constexpr double kQuiet = FilesToCome::kQuietSeconds;

FilesToCome of(const std::vector<std::string>& patterns, std::optional<FrameRange> frames = {}) {
  return *FilesToCome::of(patterns, frames);
}

TEST(FilesToCome, NoneIsNothingToWaitFor) {
  auto files = of({});
  EXPECT_THAT(Disk().look(files, 0), IsEmpty());
}

TEST(FilesToCome, AFileIsCompleteOnceItHasNotChangedForAWhile) {
  auto files = of({"fog.vdb"});
  Disk disk;
  EXPECT_THAT(disk.look(files, 100), ElementsAre("fog.vdb"));
  disk.files["fog.vdb"] = {1000, 7};
  EXPECT_THAT(disk.look(files, 1), ElementsAre("fog.vdb"));
  disk.files["fog.vdb"] = {2000, 7};
  EXPECT_THAT(disk.look(files, kQuiet), ElementsAre("fog.vdb"));
  disk.files["fog.vdb"] = {2000, 8};
  EXPECT_THAT(disk.look(files, kQuiet), ElementsAre("fog.vdb"));
  EXPECT_THAT(disk.look(files, kQuiet - 0.5), ElementsAre("fog.vdb"));
  EXPECT_THAT(disk.look(files, 0.5), IsEmpty());
}

TEST(FilesToCome, AnEmptyOrRemovedFileBeginsAnew) {
  auto files = of({"fog.vdb"});
  Disk disk;
  disk.files["fog.vdb"] = {0, 1};
  disk.look(files, 0);
  EXPECT_THAT(disk.look(files, 10 * kQuiet), ElementsAre("fog.vdb"));
  disk.files["fog.vdb"] = {5, 2};
  disk.look(files, 1);
  disk.files.clear();
  disk.look(files, 1);
  disk.files["fog.vdb"] = {5, 2};
  EXPECT_THAT(disk.look(files, kQuiet), ElementsAre("fog.vdb"));
  EXPECT_THAT(disk.look(files, kQuiet), IsEmpty());
}

TEST(FilesToCome, EachFrameHasItsFileAndEachIsLookedAtUntilItIsComplete) {
  auto files = of({"fog.####.vdb", "light.json", "light.json"}, FrameRange{8, 12, 2});
  Disk disk;
  EXPECT_THAT(disk.look(files, 0), ElementsAre("fog.0008.vdb", "fog.0010.vdb", "fog.0012.vdb", "light.json"));
  for (const char* name : {"fog.0008.vdb", "light.json", "fog.0010.vdb"}) disk.files[name] = {9, 9};
  disk.look(files, 1);
  EXPECT_THAT(disk.look(files, kQuiet), ElementsAre("fog.0012.vdb"));
  disk.files["fog.0012.vdb"] = {1, 1};
  disk.look(files, 1);
  EXPECT_THAT(disk.look(files, kQuiet), IsEmpty());
}

TEST(FilesToCome, AFileThatGrowsAgainWhileOthersAreMissingIsIncomplete) {
  auto files = of({"fog.vdb", "smoke.vdb"});
  Disk disk;
  disk.files["fog.vdb"] = {10, 1};
  disk.look(files, 0);
  EXPECT_THAT(disk.look(files, kQuiet), ElementsAre("smoke.vdb"));
  disk.files["smoke.vdb"] = {20, 2};
  disk.look(files, 1);
  disk.files["fog.vdb"] = {15, 3};
  EXPECT_THAT(disk.look(files, kQuiet), ElementsAre("fog.vdb"));
  EXPECT_THAT(disk.look(files, kQuiet), IsEmpty());
}

TEST(FilesToCome, PatternsThatNameNoFileAreRefused) {
  const auto numbers = FilesToCome::of({"fog.####.vdb"}, {});
  ASSERT_FALSE(numbers);
  EXPECT_EQ(numbers.error().code, Errc::invalid_argument);
  EXPECT_THAT(numbers.error().message, HasSubstr("--after-file fog.####.vdb: # stands for the frame number"));
  const auto folder = FilesToCome::of({std::filesystem::temp_directory_path().string()}, {});
  ASSERT_FALSE(folder);
  EXPECT_THAT(folder.error().message, HasSubstr("that is a folder"));
}

TEST(FilesToCome, TheStateOfAFileIsItsSizeAndTime) {
  EXPECT_FALSE(file_state("/nowhere/fog.vdb"));
  EXPECT_FALSE(file_state(std::filesystem::temp_directory_path()));  // folders are no files
  const auto own = file_state("/proc/self/exe");
  ASSERT_TRUE(own);
  EXPECT_GT(own->bytes, 1000U);
  EXPECT_EQ(own, file_state("/proc/self/exe"));
}

}  // namespace
}  // namespace ls::cli
