// Authentication of requests: by a bearer token, or by a session cookie that was issued for a token.
//
// A session is `expiry.nonce.token-id.mac`; the key of the MAC is the admin token. It needs no memory,
// survives a restart of the coordinator, and becomes invalid when its token is revoked. Sessions closed by
// DELETE /session are remembered until they expire or the process ends.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <variant>

#include "coordinator/http/auth/throttle.h"
#include "coordinator/http/auth/token_registry.h"
#include "coordinator/http/message/caller.h"
#include "coordinator/http/message/limits.h"
#include "coordinator/http/message/message.h"

namespace ls::http {

using UnixClock = std::function<std::int64_t()>;  // seconds since 1970
UnixClock system_unix_clock();

class Auth {
 public:
  struct Options {
    Pace requests{};      // per token, or per address without a token
    Pace failures{};      // wrong tokens per address
    bool secure = false;  // over TLS: restrict the cookie to TLS
  };
  // `tokens` must outlive this.
  Auth(const TokenRegistry& tokens, Options options, UnixClock now = system_unix_clock());

  // The caller, or a 401, 403 or 429. With an unsafe method a cookie counts only if the browser says that the
  // request comes from our own pages.
  std::variant<Caller, Response> identify(const Request& request);

  // 429 if this caller, or (without one) this address, sends too many requests.
  std::optional<Response> too_often(const Request& request, const Caller* caller);

  // True if the token of this caller has not been revoked.
  bool still_valid(const Caller& caller) const;

  // POST /session: the Set-Cookie value for a token, or the error.
  std::variant<std::string, Response> open_session(const Request& request, std::string_view token);
  // DELETE /session: invalidates the request's session, if any, and returns the Set-Cookie value that clears
  // it.
  std::string close_session(const Request& request);

  // True if Origin or Sec-Fetch-Site shows that another site sent this request.
  static bool cross_site(const Request& request);

 private:
  std::variant<Caller, Response> caller_of_token(const Request& request, std::string_view token,
                                                 std::string_view wrong);
  std::optional<Caller> caller_of_session(std::string_view session) const;
  std::string_view session_of(const Request& request) const;
  std::string mac(std::string_view text) const;
  std::string cookie(std::string_view value, std::int64_t seconds) const;

  const TokenRegistry& tokens_;
  const Options options_;
  std::string cookie_name_;  // contains part of the key's digest, since cookies are shared between ports
  UnixClock now_;
  Throttle throttle_;
  mutable std::mutex mutex_;
  std::map<std::string, std::int64_t, std::less<>> revoked_;  // session -> expiry
};

}  // namespace ls::http
