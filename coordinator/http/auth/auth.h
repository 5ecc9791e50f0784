// Authentication of requests: by a bearer token, or by a session cookie that was issued for a token.
//
// The cookie's text is `expiry.nonce.token-id.mac`; the key of the MAC is TokenRegistry::session_key(). The
// coordinator stores no open session, so sessions survive its restart. A session becomes invalid when its
// token is revoked. Sessions closed by DELETE /session are remembered, and rejected, until they expire
// (closed_sessions.h).
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <variant>

#include "coordinator/http/auth/closed_sessions.h"
#include "coordinator/http/auth/throttle.h"
#include "coordinator/http/auth/token_registry.h"
#include "coordinator/http/message/limits.h"
#include "coordinator/http/message/message.h"
#include "coordinator/views/views.h"

namespace ls::http {

using UnixClock = std::function<std::int64_t()>;  // seconds since 1970
UnixClock system_unix_clock();

class Auth {
 public:
  struct Options {
    Pace requests{};      // limits the requests with one token or, without a token, from one address
    Pace failures{};      // limits the wrong tokens from one address
    bool secure = false;  // true if requests arrive over TLS: the browser then sends the cookie only over TLS
  };
  // `tokens` must outlive the object.
  Auth(const TokenRegistry& tokens, Options options, UnixClock now = system_unix_clock());

  // Returns the sender of the request, or the response 401, 403 or 429. In a request that may change
  // something (any method but GET, HEAD and OPTIONS) a cookie is accepted only if the browser's headers show
  // that the request comes from a page of this server.
  std::variant<Caller, Response> identify(const Request& request);

  // Counts the request and returns a 429 if its caller sends too many. If the caller is null, the requests of
  // the client's address are counted instead.
  std::optional<Response> too_often(const Request& request, const Caller* caller);

  // False if the token of this caller has been revoked.
  bool still_valid(const Caller& caller) const;

  // For POST /session: returns the Set-Cookie value of a new session for this token, or the error response.
  std::variant<std::string, Response> open_session(const Request& request, std::string_view token);
  // For DELETE /session: invalidates the request's session, if it has one, and returns the Set-Cookie value
  // that removes the cookie from the browser.
  std::string close_session(const Request& request);

  // True if Origin or Sec-Fetch-Site shows that another site sent this request.
  static bool cross_site(const Request& request);

 private:
  std::variant<Caller, Response> caller_of_token(const Request& request, std::string_view token,
                                                 std::string_view wrong);
  // A session whose cookie has a valid MAC
  struct Session {
    std::int64_t expiry = 0;  // in seconds since 1970
    std::string_view text;    // the cookie's text up to the MAC
    std::string_view token_id;
  };
  std::optional<Session> parse_session(std::string_view cookie) const;
  bool is_closed(const Session& session) const;
  std::string_view session_of(const Request& request) const;
  std::string mac(std::string_view text) const;
  std::string cookie(std::string_view value, std::int64_t seconds) const;

  const TokenRegistry& tokens_;
  const Options options_;
  // Name of the session cookie. It contains part of the digest of the session key: browsers share cookies
  // between all ports of a host, and two coordinators on one host must not overwrite each other's cookies.
  std::string cookie_name_;
  UnixClock now_;
  Throttle throttle_;
  ClosedSessions closed_;
};

// Clears the fields of `worker` that describe its work for other users' jobs.
void hide_work(coordinator::WorkerView& worker);

// Returns the event without the parts that this caller may not see; nullopt: the caller may not see any part
// of the event.
std::optional<coordinator::StreamEvent> visible(const coordinator::StreamEvent& event, const Caller& caller);

}  // namespace ls::http
