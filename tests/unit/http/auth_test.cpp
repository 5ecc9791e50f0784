#include "coordinator/http/auth.h"

#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "coordinator/http/token_file.h"
#include "tests/unit/http/fixture.h"

namespace ls::http::testing {
namespace {

std::int64_t now = 1'000'000;

class AuthTest : public ::testing::Test {
 protected:
  Auth auth{kToken, [] { return now; }};

  std::string cookie() {
    const std::string set = *auth.open_session(kToken);
    return set.substr(0, set.find(';'));
  }
  int status(Method method, Fields headers) {
    const auto refused = auth.refuse(request(method, "/api/v1/jobs", std::move(headers)));
    return refused ? refused->status : 200;
  }
};

TEST_F(AuthTest, LetsInTheTokenOnly) {
  EXPECT_EQ(status(Method::get, {{"authorization", std::string("Bearer ") + kToken}}), 200);
  EXPECT_EQ(status(Method::get, {{"authorization", std::string("bearer  ") + kToken}}), 200);

  EXPECT_EQ(status(Method::get, {}), 401);
  EXPECT_EQ(status(Method::get, {{"authorization", "Bearer "}}), 401);
  EXPECT_EQ(status(Method::get, {{"authorization", kToken}}), 401);
  EXPECT_EQ(status(Method::get, {{"authorization", std::string("Basic ") + kToken}}), 401);
  EXPECT_EQ(status(Method::get, {{"authorization", std::string("Bearer ") + kToken + "0"}}), 401);
  EXPECT_EQ(status(Method::get, {{"authorization", "Bearer 0123456789abcdef0123456789abcde"}}), 401);
}

TEST_F(AuthTest, SaysHowToAuthenticate) {
  const auto refused = auth.refuse(request(Method::get, "/api/v1/jobs"));

  ASSERT_TRUE(refused);
  EXPECT_EQ(refused->headers.front().first, "WWW-Authenticate");
  EXPECT_EQ(refused->headers.front().second.substr(0, 6), "Bearer");
}

TEST_F(AuthTest, TradesTheTokenForACookieThatScriptsAndOtherSitesCannotUse) {
  EXPECT_FALSE(auth.open_session("wrong"));
  const std::string set = *auth.open_session(kToken);

  EXPECT_NE(set.find("; HttpOnly"), std::string::npos);
  EXPECT_NE(set.find("; SameSite=Strict"), std::string::npos);
  EXPECT_EQ(set.find(kToken), std::string::npos);
  EXPECT_EQ(status(Method::get, {{"cookie", "theme=dark; " + cookie()}}), 200);
}

TEST_F(AuthTest, RefusesAChangedOrExpiredOrClosedSession) {
  const std::string good = cookie();
  std::string later = good;
  later.replace(later.find('=') + 1, 1, "9");  // an expiry further off, with the old mac
  EXPECT_EQ(status(Method::get, {{"cookie", later}}), 401);
  EXPECT_EQ(status(Method::get, {{"cookie", good.substr(0, good.size() - 1)}}), 401);

  EXPECT_EQ(status(Method::get, {{"cookie", good}}), 200);
  now += kSessionSeconds;
  EXPECT_EQ(status(Method::get, {{"cookie", good}}), 401);

  const std::string other = cookie();
  auth.close_session(request(Method::del, "/api/v1/session", {{"cookie", other}}));
  EXPECT_EQ(status(Method::get, {{"cookie", other}}), 401);
  EXPECT_EQ(status(Method::get, {{"cookie", cookie()}}), 200);
}

TEST_F(AuthTest, SurvivesARestartOfTheCoordinator) {
  const std::string before = cookie();

  Auth restarted(kToken, [] { return now; });

  EXPECT_FALSE(restarted.refuse(request(Method::get, "/api/v1/jobs", {{"cookie", before}})));
}

TEST_F(AuthTest, LetsACookieChangeThingsFromOurOwnPagesOnly) {
  const std::string session = cookie();

  EXPECT_EQ(status(Method::post, {{"cookie", session}, {"origin", "http://farm:8080"}}), 200);
  EXPECT_EQ(status(Method::post, {{"cookie", session}, {"origin", "https://farm:8080"}}), 200);
  EXPECT_EQ(status(Method::post, {{"cookie", session}, {"sec-fetch-site", "same-origin"}}), 200);

  EXPECT_EQ(status(Method::post, {{"cookie", session}}), 403);
  EXPECT_EQ(status(Method::post, {{"cookie", session}, {"origin", "null"}}), 403);
  EXPECT_EQ(status(Method::del, {{"cookie", session}, {"origin", "http://evil:8080"}}), 403);
  EXPECT_EQ(status(Method::patch, {{"cookie", session}, {"origin", "http://farm:8081"}}), 403);
  EXPECT_EQ(status(Method::put,
                   {{"cookie", session}, {"origin", "http://farm:8080"}, {"sec-fetch-site", "cross-site"}}),
            403);
}

TEST(TokenFile, IsMadeOnceAndReadableByItsOwnerOnly) {
  const auto folder = std::filesystem::temp_directory_path() / ("ls-token-" + std::to_string(::getpid()));
  std::filesystem::create_directories(folder);
  const auto file = folder / "token";

  const auto made = read_or_make_token(file);
  ASSERT_TRUE(made) << made.error().message;
  EXPECT_EQ(made->size(), 64u);
  EXPECT_EQ(std::filesystem::status(file).permissions(),
            std::filesystem::perms::owner_read | std::filesystem::perms::owner_write);
  EXPECT_EQ(*read_or_make_token(file), *made);
  EXPECT_NE(*read_or_make_token(folder / "other"), *made);

  ::chmod(file.c_str(), 0644);
  ASSERT_FALSE(read_or_make_token(file));
  EXPECT_NE(read_or_make_token(file).error().message.find("chmod 600"), std::string::npos);

  std::ofstream(folder / "other", std::ios::trunc) << "short\n";
  EXPECT_FALSE(read_or_make_token(folder / "other"));
  std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace ls::http::testing
