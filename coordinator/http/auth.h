// Who may ask. A request shows a bearer token, or a session cookie that a token was traded for.
//
// A session is `expiry.nonce.token-id.mac`, the mac keyed by the admin token: it needs no memory, survives a
// restart of the coordinator, and is worth what its token is worth: nothing once that is revoked. Sessions
// closed by DELETE /session are remembered until they expire or the process ends.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <variant>

#include "coordinator/http/caller.h"
#include "coordinator/http/limits.h"
#include "coordinator/http/message.h"
#include "coordinator/http/throttle.h"
#include "coordinator/http/token_book.h"

namespace ls::http {

using UnixClock = std::function<std::int64_t()>;  // seconds since 1970
UnixClock system_unix_clock();

class Auth {
 public:
  struct Options {
    Pace requests{};      // of one token, or of one address without any
    Pace failures{};      // wrong tokens of one address
    bool secure = false;  // over TLS: the cookie is for it alone
  };
  // `book` outlives this.
  Auth(const TokenBook& book, Options options, UnixClock now = system_unix_clock());

  // Who asks, else the 401, 403 or 429. A cookie counts for an unsafe method only if the browser says that
  // the request comes from our own pages.
  std::variant<Caller, Response> identify(const Request& request);

  // 429 if this one, or (without a caller) this address, asks too often.
  std::optional<Response> too_often(const Request& request, const Caller* caller);

  // Whether the token that this caller came with is still worth anything.
  bool still_valid(const Caller& caller) const;

  // POST /session: the Set-Cookie value for a token, else why not.
  std::variant<std::string, Response> open_session(const Request& request, std::string_view token);
  // DELETE /session: forgets the request's session, if it has one; gives the Set-Cookie value that clears it.
  std::string close_session(const Request& request);

  // Origin or Sec-Fetch-Site shows that another site sent this.
  static bool cross_site(const Request& request);

 private:
  std::variant<Caller, Response> caller_of_token(const Request& request, std::string_view token,
                                                 std::string_view wrong);
  std::optional<Caller> caller_of_session(std::string_view session) const;
  std::string_view session_of(const Request& request) const;
  std::string mac(std::string_view text) const;
  std::string cookie(std::string_view value, std::int64_t seconds) const;

  const TokenBook& book_;
  const Options options_;
  std::string cookie_name_;  // has a part of the key's digest: cookies don't tell ports apart
  UnixClock now_;
  Throttle throttle_;
  mutable std::mutex mutex_;
  std::map<std::string, std::int64_t, std::less<>> revoked_;  // session -> expiry
};

}  // namespace ls::http
