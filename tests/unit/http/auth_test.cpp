#include "coordinator/http/auth/auth.h"

#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "tests/unit/http/fixture.h"
#include "tests/unit/store/temp_folder.h"

namespace ls::http::testing {
namespace {

std::int64_t now = 1'000'000;

class AuthTest : public ::testing::Test {
 protected:
  TokenRegistry tokens{kToken, kJoinToken};
  Auth auth{tokens, {}, [] { return now; }};

  std::string cookie(std::string_view token = kToken) {
    const std::string set = std::get<std::string>(auth.open_session({}, token));
    return set.substr(0, set.find(';'));
  }
  static Fields bearer(const std::string& token) { return {{"authorization", "Bearer " + token}}; }
  std::variant<Caller, Response> identify(Method method, Fields headers) {
    return auth.identify(request(method, "/api/v1/jobs", std::move(headers)));
  }
  int status(Method method, Fields headers) {
    const auto found = identify(method, std::move(headers));
    const auto* refused = std::get_if<Response>(&found);
    return refused ? refused->status : 200;
  }
};

TEST_F(AuthTest, AcceptsOnlyTheToken) {
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
  const auto found = identify(Method::get, {});

  const auto& refused = std::get<Response>(found);
  EXPECT_EQ(refused.headers.front().first, "WWW-Authenticate");
  EXPECT_EQ(refused.headers.front().second.substr(0, 6), "Bearer");
}

TEST_F(AuthTest, ExchangesTheTokenForACookieThatScriptsAndOtherSitesCannotUse) {
  EXPECT_EQ(std::get<Response>(auth.open_session({}, "wrong")).status, 401);
  const std::string set = std::get<std::string>(auth.open_session({}, kToken));

  EXPECT_NE(set.find("; HttpOnly"), std::string::npos);
  EXPECT_NE(set.find("; SameSite=Strict"), std::string::npos);
  EXPECT_EQ(set.find(kToken), std::string::npos);
  EXPECT_EQ(status(Method::get, {{"cookie", "theme=dark; " + cookie()}}), 200);
}

TEST_F(AuthTest, RefusesAChangedOrExpiredOrClosedSession) {
  const std::string good = cookie();
  std::string later = good;
  later.replace(later.find('=') + 1, 1, "9");  // a later expiry with the old MAC
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

TEST(ClosedSessions, StayClosedAfterARestartAndAtOtherCoordinators) {
  const TempFolder folder;
  const auto clock = [] { return now; };
  const auto tokens = TokenRegistry::open(folder.path()).value();
  const auto others_tokens = TokenRegistry::open(folder.path()).value();
  Auth auth(*tokens, {}, clock), other(*others_tokens, {}, clock);
  std::ifstream file(folder.path() / "token");
  std::string token;
  file >> token;
  const auto cookie_of = [](const std::string& set) { return set.substr(0, set.find(';')); };
  const std::string closed = cookie_of(std::get<std::string>(auth.open_session({}, token)));
  const std::string open = cookie_of(std::get<std::string>(auth.open_session({}, token)));
  const auto accepted = [](Auth& by, const std::string& cookie) {
    return std::holds_alternative<Caller>(
        by.identify(request(Method::get, "/api/v1/jobs", {{"cookie", cookie}})));
  };
  ASSERT_TRUE(accepted(other, closed));

  auth.close_session(request(Method::del, "/api/v1/session", {{"cookie", closed}}));

  EXPECT_FALSE(accepted(auth, closed));
  EXPECT_FALSE(accepted(other, closed));
  const auto tokens_again = TokenRegistry::open(folder.path()).value();
  Auth again(*tokens_again, {}, clock);
  EXPECT_FALSE(accepted(again, closed));
  EXPECT_TRUE(accepted(again, open));
  struct stat info {};
  ASSERT_EQ(::stat((folder.path() / "closed-sessions").c_str(), &info), 0);
  EXPECT_EQ(info.st_mode & 0777, 0600u);
}

TEST(ClosedSessions, OverflowClosesAllOlderSessions) {
  const TempFolder folder;
  {
    ClosedSessions sessions(folder.path());
    for (std::size_t i = 0; i < 3 * kMaxClosedSessions; ++i)
      sessions.close("t", now + 100 + static_cast<std::int64_t>(i), std::to_string(i), now);
  }

  const ClosedSessions again(folder.path());

  for (const std::size_t i : {std::size_t{0}, kMaxClosedSessions, 3 * kMaxClosedSessions - 1})
    EXPECT_TRUE(again.contains("t", now + 100 + static_cast<std::int64_t>(i), std::to_string(i))) << i;
  EXPECT_FALSE(again.contains("t", now + 100'000, "open"));
  EXPECT_FALSE(again.contains("u", now + 100, "0"));
  EXPECT_LT(std::filesystem::file_size(folder.path() / "closed-sessions"), 4 * kMaxClosedSessions * 100);
}

// Someone with a read token could open and close many sessions so that an earlier closed one is forgotten and
// becomes valid again.
TEST_F(AuthTest, ClosedSessionStaysClosedAfterManyOthersAreClosed) {
  const auto close = [&](const std::string& session) {
    auth.close_session(request(Method::del, "/api/v1/session", {{"cookie", session}}));
  };
  const auto reader = tokens.add(Role::read, "");
  ASSERT_TRUE(reader);
  const std::string of_admin = cookie(), first = cookie(reader->token), open = cookie(reader->token);
  close(first);
  now += 60;

  for (std::size_t i = 0; i < 2 * kMaxClosedSessions; ++i) close(cookie(reader->token));

  EXPECT_EQ(status(Method::get, {{"cookie", first}}), 401);
  EXPECT_EQ(status(Method::get, {{"cookie", open}}), 401) << "as old as one that is not remembered";
  EXPECT_EQ(status(Method::get, {{"cookie", of_admin}}), 200) << "of another token";
  now += 1;
  EXPECT_EQ(status(Method::get, {{"cookie", cookie(reader->token)}}), 200) << "a new one";
}

TEST_F(AuthTest, SurvivesARestartOfTheCoordinator) {
  const std::string before = cookie();

  const TokenRegistry same(kToken, "another join token");
  Auth restarted(same, {}, [] { return now; });

  EXPECT_TRUE(std::holds_alternative<Caller>(
      restarted.identify(request(Method::get, "/api/v1/jobs", {{"cookie", before}}))));
}

TEST_F(AuthTest, CookieMayChangeThingsOnlyFromTheDashboardsPages) {
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
  EXPECT_EQ(status(Method::put,
                   {{"cookie", session}, {"origin", "http://farm:8080"}, {"sec-fetch-site", "same-site"}}),
            403);
}

TEST_F(AuthTest, SessionHasTheRoleOfItsTokenAndEndsWithIt) {
  const auto made = tokens.add(Role::submit, "anna");
  ASSERT_TRUE(made);
  const std::string session = cookie(made->token);

  const auto found = identify(Method::get, {{"cookie", session}});
  ASSERT_TRUE(std::holds_alternative<Caller>(found));
  EXPECT_EQ(std::get<Caller>(found).role, Role::submit);
  EXPECT_EQ(std::get<Caller>(found).user, "anna");
  // The MAC covers the token's id in the cookie: replacing the id makes the cookie invalid.
  std::string other = session;
  const std::string admin_id = tokens.list().front().id;
  other.replace(other.find(made->info.id), admin_id.size(), admin_id);
  EXPECT_EQ(status(Method::get, {{"cookie", other}}), 401);

  ASSERT_TRUE(tokens.revoke(made->info.id));
  EXPECT_EQ(status(Method::get, {{"cookie", session}}), 401);
  EXPECT_EQ(status(Method::get, bearer(made->token)), 401);
}

TEST_F(AuthTest, JoinTokenMayUseNoRoute) {
  EXPECT_EQ(status(Method::get, bearer(kJoinToken)), 403);
  EXPECT_EQ(std::get<Response>(auth.open_session({}, kJoinToken)).status, 403);
  EXPECT_TRUE(tokens.may_join(kJoinToken));
  EXPECT_FALSE(tokens.may_join(kToken));
  EXPECT_FALSE(tokens.may_join(""));
}

TEST_F(AuthTest, CookieIsSecureOverTls) {
  Auth over_tls(tokens, {.secure = true}, [] { return now; });
  EXPECT_NE(std::get<std::string>(over_tls.open_session({}, kToken)).find("; Secure"), std::string::npos);
  EXPECT_EQ(std::get<std::string>(auth.open_session({}, kToken)).find("; Secure"), std::string::npos);
}

TEST_F(AuthTest, GuessingIsBlockedButKnownTokensStillWork) {
  Auth strict(tokens, {.failures = {.per_second = .5, .burst = 3}}, [] { return now; });
  const auto ask = [&](const std::string& token, const std::string& from) {
    Request r = request(Method::get, "/api/v1/jobs", bearer(token));
    r.peer = from;
    const auto found = strict.identify(r);
    const auto* refused = std::get_if<Response>(&found);
    return refused ? refused->status : 200;
  };
  const std::string read = tokens.add(Role::read, "").value().token;
  EXPECT_EQ(ask(kToken, "10.0.0.1"), 200);
  for (int i = 0; i < 3; ++i) EXPECT_EQ(ask("wrong", "10.0.0.1"), 401) << i;

  EXPECT_EQ(ask("wrong", "10.0.0.1"), 429);
  EXPECT_EQ(ask(read, "10.0.0.1"), 429);  // the answer does not reveal that the guess was right
  EXPECT_EQ(ask(kToken, "10.0.0.1"), 200);
  EXPECT_EQ(ask("wrong", "10.0.0.2"), 401);
  now += 2;
  EXPECT_EQ(ask(read, "10.0.0.1"), 200);
}

TEST_F(AuthTest, EachTokenHasItsShareOfRequests) {
  Auth strict(tokens, {.requests = {.per_second = 2, .burst = 4}}, [] { return now; });
  const Request r = request(Method::get, "/api/v1/jobs");
  const Caller anna{Role::submit, "anna", "a"}, bert{Role::submit, "bert", "b"};
  for (int i = 0; i < 4; ++i) EXPECT_FALSE(strict.too_often(r, &anna)) << i;

  const auto refused = strict.too_often(r, &anna);
  ASSERT_TRUE(refused);
  EXPECT_EQ(refused->status, 429);
  EXPECT_EQ(refused->headers.back(), (std::pair<std::string, std::string>{"Retry-After", "1"}));
  EXPECT_FALSE(strict.too_often(r, &bert));
  EXPECT_FALSE(strict.too_often(r, nullptr));
  now += 1;
  for (int i = 0; i < 2; ++i) EXPECT_FALSE(strict.too_often(r, &anna)) << i;
  EXPECT_TRUE(strict.too_often(r, &anna));
}

TEST(Throttle, CountsAnIpv6NetworkAsOneAddress) {
  EXPECT_EQ(Throttle::group_of("2001:db8:1:2:3:4:5:6"), Throttle::group_of("2001:db8:1:2:9:9:9:9"));
  EXPECT_NE(Throttle::group_of("2001:db8:1:2:3:4:5:6"), Throttle::group_of("2001:db8:1:3:3:4:5:6"));
  EXPECT_EQ(Throttle::group_of("10.0.0.1"), "10.0.0.1");
  EXPECT_EQ(Throttle::group_of("::ffff:10.0.0.1"), "::ffff:10.0.0.1");
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
