#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "cli/output/awaited_files.h"

namespace ls::cli {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

// Files by name, and a clock that the tests set.
struct Disk {
  std::map<std::string, FileState> files;
  double now = 0;
  std::vector<std::string> look(AwaitedFiles& awaited, double seconds) {
    now += seconds;
    return awaited.look(now, [&](const std::string& path) -> std::optional<FileState> {
      const auto found = files.find(path);
      return found == files.end() ? std::nullopt : std::optional(found->second);
    });
  }
};

constexpr double kQuiet = AwaitedFiles::kQuietSeconds;

AwaitedFiles of(const std::vector<std::string>& patterns, std::optional<FrameRange> frames = {}) {
  return *AwaitedFiles::of(patterns, frames);
}

TEST(AwaitedFiles, NoneIsNothingToWaitFor) {
  auto awaited = of({});
  EXPECT_THAT(Disk().look(awaited, 0), IsEmpty());
}

TEST(AwaitedFiles, AFileIsCompleteOnceItHasNotChangedForAWhile) {
  auto awaited = of({"fog.vdb"});
  Disk disk;
  EXPECT_THAT(disk.look(awaited, 100), ElementsAre("fog.vdb"));
  disk.files["fog.vdb"] = {1000, 7};
  EXPECT_THAT(disk.look(awaited, 1), ElementsAre("fog.vdb"));
  disk.files["fog.vdb"] = {2000, 7};
  EXPECT_THAT(disk.look(awaited, kQuiet), ElementsAre("fog.vdb"));
  disk.files["fog.vdb"] = {2000, 8};
  EXPECT_THAT(disk.look(awaited, kQuiet), ElementsAre("fog.vdb"));
  EXPECT_THAT(disk.look(awaited, kQuiet - 0.5), ElementsAre("fog.vdb"));
  EXPECT_THAT(disk.look(awaited, 0.5), IsEmpty());
}

TEST(AwaitedFiles, AnEmptyOrRemovedFileBeginsAnew) {
  auto awaited = of({"fog.vdb"});
  Disk disk;
  disk.files["fog.vdb"] = {0, 1};
  disk.look(awaited, 0);
  EXPECT_THAT(disk.look(awaited, 10 * kQuiet), ElementsAre("fog.vdb"));
  disk.files["fog.vdb"] = {5, 2};
  disk.look(awaited, 1);
  disk.files.clear();
  disk.look(awaited, 1);
  disk.files["fog.vdb"] = {5, 2};
  EXPECT_THAT(disk.look(awaited, kQuiet), ElementsAre("fog.vdb"));
  EXPECT_THAT(disk.look(awaited, kQuiet), IsEmpty());
}

TEST(AwaitedFiles, EachFrameHasItsFileAndEachIsLookedAtUntilItIsComplete) {
  auto awaited = of({"fog.####.vdb", "light.json", "light.json"}, FrameRange{8, 12, 2});
  Disk disk;
  EXPECT_THAT(disk.look(awaited, 0), ElementsAre("fog.0008.vdb", "fog.0010.vdb", "fog.0012.vdb", "light.json"));
  for (const char* name : {"fog.0008.vdb", "light.json", "fog.0010.vdb"}) disk.files[name] = {9, 9};
  disk.look(awaited, 1);
  EXPECT_THAT(disk.look(awaited, kQuiet), ElementsAre("fog.0012.vdb"));
  disk.files.clear();
  disk.files["fog.0012.vdb"] = {1, 1};
  disk.look(awaited, 1);
  EXPECT_THAT(disk.look(awaited, kQuiet), IsEmpty());
}

TEST(AwaitedFiles, PatternsThatNameNoFileAreRefused) {
  const auto numbers = AwaitedFiles::of({"fog.####.vdb"}, {});
  ASSERT_FALSE(numbers);
  EXPECT_EQ(numbers.error().code, Errc::invalid_argument);
  EXPECT_THAT(numbers.error().message, HasSubstr("--after-file fog.####.vdb: # stands for the frame number"));
  const auto folder = AwaitedFiles::of({std::filesystem::temp_directory_path().string()}, {});
  ASSERT_FALSE(folder);
  EXPECT_THAT(folder.error().message, HasSubstr("that is a folder"));
}

TEST(AwaitedFiles, TheStateOfAFileIsItsSizeAndTime) {
  EXPECT_FALSE(file_state("/nowhere/fog.vdb"));
  const auto own = file_state("/proc/self/exe");
  ASSERT_TRUE(own);
  EXPECT_GT(own->bytes, 1000U);
  EXPECT_EQ(own, file_state("/proc/self/exe"));
}

}  // namespace
}  // namespace ls::cli
