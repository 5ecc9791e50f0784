#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <iterator>

#include "cli/output/output_file.h"

namespace ls::cli {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

// A folder in which nobody, not even root, can create a file.
const fs::path kClosed = "/proc/self";

class OutputFile : public testing::Test {
 protected:
  OutputFile() {
    std::string pattern = (fs::temp_directory_path() / "ls-output-XXXXXX").string();
    folder_ = ::mkdtemp(pattern.data());
  }
  ~OutputFile() override { fs::remove_all(folder_); }
  fs::path folder_;
};

TEST_F(OutputFile, IsRefusedBeforeRenderingIfItsFolderIsUnwritable) {
  const auto refused = check_output("-o", kClosed / "out.exr");

  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, Errc::invalid_argument);
  EXPECT_THAT(refused.error().message, AllOf(HasSubstr("-o"), HasSubstr(kClosed.string())));
  EXPECT_FALSE(PartialDir::open(kClosed));
}

TEST_F(OutputFile, IsNotTouchedByTheCheck) {
  std::ofstream(folder_ / "out.exr") << "yesterday's";

  EXPECT_TRUE(check_output("-o", folder_ / "out.exr"));
  EXPECT_TRUE(check_output("-o", folder_ / "new.exr"));
  EXPECT_TRUE(check_output("-o", "/dev/null"));

  EXPECT_EQ(std::distance(fs::directory_iterator(folder_), fs::directory_iterator()), 1);
  EXPECT_EQ(fs::file_size(folder_ / "out.exr"), 11U);
}

TEST_F(OutputFile, IsSavedInAnotherFolderIfItsOwnBecameUnwritable) {
  const char* before = std::getenv("TMPDIR");
  const std::string kept = before ? before : "";
  ::setenv("TMPDIR", folder_.c_str(), 1);
  const auto saved = save_result(kClosed / "out.exr", std::string("hours of work"));
  before ? ::setenv("TMPDIR", kept.c_str(), 1) : ::unsetenv("TMPDIR");

  ASSERT_FALSE(saved);
  const fs::path rescued = fs::directory_iterator(folder_)->path();
  EXPECT_THAT(saved.error().message, AllOf(HasSubstr(kClosed.string()), HasSubstr(rescued.string())));
  EXPECT_EQ(rescued.extension(), ".exr");
  std::ifstream in(rescued);
  EXPECT_EQ(std::string(std::istreambuf_iterator<char>(in), {}), "hours of work");
}

}  // namespace
}  // namespace ls::cli
