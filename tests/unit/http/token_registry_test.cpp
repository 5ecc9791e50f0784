#include "coordinator/http/auth/token_registry.h"

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

TEST(TokenRegistry, StoresDigestsAndNeverTokens) {
  TempFolder dir;
  std::string annas, id;
  {
    auto tokens = TokenRegistry::open(dir.path());
    ASSERT_TRUE(tokens) << tokens.error().message;
    const auto made = (*tokens)->add(Role::submit, "anna");
    ASSERT_TRUE(made);
    annas = made->token, id = made->info.id;
    EXPECT_EQ((*tokens)->find(annas)->user, "anna");
  }
  EXPECT_EQ(content(dir.path() / "tokens").find(annas), std::string::npos);
  struct stat info {};
  ASSERT_EQ(::stat((dir.path() / "tokens").c_str(), &info), 0);
  EXPECT_EQ(info.st_mode & 0777, 0600u);

  auto again = TokenRegistry::open(dir.path());
  ASSERT_TRUE(again);
  const auto caller = (*again)->find(annas);
  ASSERT_TRUE(caller);
  EXPECT_EQ(caller->role, Role::submit);
  EXPECT_EQ(caller->user, "anna");
  ASSERT_TRUE((*again)->revoke(id));
  EXPECT_FALSE((*again)->find(annas));
  EXPECT_FALSE((*TokenRegistry::open(dir.path()))->find(annas));
}

TEST(TokenRegistry, TokensFromFilesAreAdminAndJoinAndCannotBeRevoked) {
  TempFolder dir;
  auto tokens = TokenRegistry::open(dir.path());
  ASSERT_TRUE(tokens);
  std::string admin = content(dir.path() / "token"), join = content(dir.path() / "join-token");
  admin.pop_back(), join.pop_back();

  EXPECT_EQ((*tokens)->find(admin)->role, Role::admin);
  EXPECT_EQ((*tokens)->find(admin)->user, "");
  EXPECT_EQ((*tokens)->find(join)->role, Role::join);
  EXPECT_FALSE((*tokens)->find(""));
  for (const TokenInfo& token : (*tokens)->list()) {
    EXPECT_TRUE(token.of_file);
    EXPECT_EQ((*tokens)->revoke(token.id).error().code, Errc::failed_precondition);
  }
  EXPECT_EQ((*tokens)->revoke("0000000000000000").error().code, Errc::not_found);
}

TEST(TokenRegistry, RefusesConfusableUserNamesAndThoseThatBreakTheFile) {
  TokenRegistry tokens("0123456789abcdef");
  for (const char* wrong : {"", " anna", "an na", "anna\nadmin", "#anna", "-", "\xc3\xa4", ".."})
    EXPECT_FALSE(tokens.add(Role::submit, wrong)) << wrong;
  EXPECT_FALSE(tokens.add(Role::submit, std::string(kMaxUserName + 1, 'a')));
  EXPECT_TRUE(tokens.add(Role::submit, "anna.b-c_d@lab"));
  EXPECT_TRUE(tokens.add(Role::read, ""));
}

TEST(TokenRegistry, NamesAMalformedLine) {
  const std::string digest = sha256("x").hex();
  for (const std::string& wrong :
       std::vector<std::string>{"boss anna " + digest, "submit - " + digest, "read anna " + digest + "0",
                                "read anna", "read a/b " + digest, "read anna " + digest + " more",
                                "read a " + digest + "\nread b " + digest}) {
    TempFolder dir;
    write(dir.path() / "tokens", "# people\n\n" + wrong + "\n");
    const auto tokens = TokenRegistry::open(dir.path());
    ASSERT_FALSE(tokens) << wrong;
    EXPECT_NE(tokens.error().message.find("tokens:"), std::string::npos) << tokens.error().message;
  }
  TempFolder dir;
  write(dir.path() / "tokens", "read - " + digest + "  # the monitor\n");
  EXPECT_EQ((*TokenRegistry::open(dir.path()))->find("x")->role, Role::read);
}

TEST(TokenRegistry, DoesNotChangeAnUnreadableFile) {
  TempFolder dir;
  const auto file = dir.path() / "tokens";
  const auto tokens = TokenRegistry::open(dir.path()).value();
  const auto made = tokens->add(Role::submit, "anna").value();
  const std::string sound = content(file), edited = sound + "boss ben " + sha256("ben").hex() + "\n";
  write(file, edited);

  const auto added = tokens->add(Role::submit, "cora");
  const auto revoked = tokens->revoke(made.info.id);

  ASSERT_FALSE(added);
  EXPECT_NE(added.error().message.find("tokens:3:"), std::string::npos) << added.error().message;
  EXPECT_FALSE(revoked);
  EXPECT_EQ(content(file), edited);
  EXPECT_TRUE(tokens->find(made.token)) << "the tokens of before count";

  ::chmod(file.c_str(), 0620);  // another error, which does not change the file's time or size
  EXPECT_FALSE(tokens->revoke(made.info.id));
  write(file, sound);
  EXPECT_TRUE(tokens->revoke(made.info.id));
  EXPECT_FALSE(tokens->find(made.token));
}

TEST(TokenRegistry, RereadsAFileThatWasUnreadable) {
  TempFolder dir;
  const auto file = dir.path() / "tokens";
  const auto tokens = TokenRegistry::open(dir.path()).value();
  write(file, "read - " + sha256("x").hex() + "\n");
  ::chmod(file.c_str(), 0620);
  EXPECT_FALSE(tokens->find("x"));

  ::chmod(file.c_str(), 0600);  // this changes neither size nor time

  EXPECT_TRUE(tokens->find("x"));
}

TEST(TokenRegistry, RefusesAFileThatOthersMayWriteAndEqualTokens) {
  TempFolder dir;
  write(dir.path() / "tokens", "");
  ::chmod((dir.path() / "tokens").c_str(), 0620);
  EXPECT_NE(TokenRegistry::open(dir.path()).error().message.find("chmod go-w"), std::string::npos);

  TempFolder same;
  write(same.path() / "token", "0123456789abcdef0123\n");
  write(same.path() / "join-token", "0123456789abcdef0123\n");
  EXPECT_EQ(TokenRegistry::open(same.path()).error().code, Errc::failed_precondition);
}

}  // namespace
}  // namespace ls::http::testing
