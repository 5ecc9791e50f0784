#include "coordinator/http/token_book.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <fstream>
#include <sstream>

#include "tests/unit/store/temp_folder.h"

namespace ls::http::testing {
namespace {

using coordinator::TempFolder;

std::string content(const std::filesystem::path& file) {
  std::ostringstream out;
  out << std::ifstream(file).rdbuf();
  return out.str();
}

void write(const std::filesystem::path& file, const std::string& text) {
  std::ofstream(file, std::ios::trunc) << text;
  ::chmod(file.c_str(), 0600);
}

TEST(TokenBook, KeepsDigestsOfWhatItMadeAndNeverTheTokens) {
  TempFolder dir;
  std::string annas, id;
  {
    auto book = TokenBook::open(dir.path());
    ASSERT_TRUE(book) << book.error().message;
    const auto made = (*book)->add(Role::submit, "anna");
    ASSERT_TRUE(made);
    annas = made->token, id = made->info.id;
    EXPECT_EQ((*book)->find(annas)->user, "anna");
  }
  EXPECT_EQ(content(dir.path() / "tokens").find(annas), std::string::npos);
  struct stat info {};
  ASSERT_EQ(::stat((dir.path() / "tokens").c_str(), &info), 0);
  EXPECT_EQ(info.st_mode & 0777, 0600u);

  auto again = TokenBook::open(dir.path());
  ASSERT_TRUE(again);
  const auto caller = (*again)->find(annas);
  ASSERT_TRUE(caller);
  EXPECT_EQ(caller->role, Role::submit);
  EXPECT_EQ(caller->user, "anna");
  ASSERT_TRUE((*again)->revoke(id));
  EXPECT_FALSE((*again)->find(annas));
  EXPECT_FALSE((*TokenBook::open(dir.path()))->find(annas));
}

TEST(TokenBook, TheFilesOfTheFolderAreAdminAndJoinAndCannotBeRevoked) {
  TempFolder dir;
  auto book = TokenBook::open(dir.path());
  ASSERT_TRUE(book);
  std::string admin = content(dir.path() / "token"), join = content(dir.path() / "join-token");
  admin.pop_back(), join.pop_back();

  EXPECT_EQ((*book)->find(admin)->role, Role::admin);
  EXPECT_EQ((*book)->find(admin)->user, "");
  EXPECT_EQ((*book)->find(join)->role, Role::join);
  EXPECT_FALSE((*book)->find(""));
  for (const TokenInfo& token : (*book)->list()) {
    EXPECT_TRUE(token.of_file);
    EXPECT_EQ((*book)->revoke(token.id).error().code, Errc::failed_precondition);
  }
  EXPECT_EQ((*book)->revoke("0000000000000000").error().code, Errc::not_found);
}

TEST(TokenBook, RefusesUsersThatCouldBeMistakenOrBreakTheFile) {
  TokenBook book("0123456789abcdef");
  for (const char* wrong : {"", " anna", "an na", "anna\nadmin", "#anna", "-", "\xc3\xa4", ".."})
    EXPECT_FALSE(book.add(Role::submit, wrong)) << wrong;
  EXPECT_FALSE(book.add(Role::submit, std::string(kMaxUserName + 1, 'a')));
  EXPECT_TRUE(book.add(Role::submit, "anna.b-c_d@lab"));
  EXPECT_TRUE(book.add(Role::read, ""));
}

TEST(TokenBook, NamesALineThatIsNone) {
  const std::string digest = sha256("x").hex();
  for (const std::string& wrong :
       std::vector<std::string>{"boss anna " + digest, "submit - " + digest, "read anna " + digest + "0",
                                "read anna", "read a/b " + digest, "read anna " + digest + " more",
                                "read a " + digest + "\nread b " + digest}) {
    TempFolder dir;
    write(dir.path() / "tokens", "# people\n\n" + wrong + "\n");
    const auto book = TokenBook::open(dir.path());
    ASSERT_FALSE(book) << wrong;
    EXPECT_NE(book.error().message.find("tokens:"), std::string::npos) << book.error().message;
  }
  TempFolder dir;
  write(dir.path() / "tokens", "read - " + digest + "  # the monitor\n");
  EXPECT_EQ((*TokenBook::open(dir.path()))->find("x")->role, Role::read);
}

TEST(TokenBook, RefusesAFileThatOthersMayWriteAndTokensThatAreOne) {
  TempFolder dir;
  write(dir.path() / "tokens", "");
  ::chmod((dir.path() / "tokens").c_str(), 0620);
  EXPECT_NE(TokenBook::open(dir.path()).error().message.find("chmod go-w"), std::string::npos);

  TempFolder same;
  write(same.path() / "token", "0123456789abcdef0123\n");
  write(same.path() / "join-token", "0123456789abcdef0123\n");
  EXPECT_EQ(TokenBook::open(same.path()).error().code, Errc::failed_precondition);
}

}  // namespace
}  // namespace ls::http::testing
