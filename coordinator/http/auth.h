// Who may ask. A request shows the bearer token, or a session cookie that the token was traded for.
//
// A session is `expiry.nonce.mac`, the mac keyed by the token: it needs no memory and survives a restart of
// the coordinator. Sessions closed by DELETE /session are remembered until they expire or the process ends.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>

#include "coordinator/http/message.h"

namespace ls::http {

using UnixClock = std::function<std::int64_t()>;  // seconds since 1970
UnixClock system_unix_clock();

class Auth {
 public:
  explicit Auth(std::string token, UnixClock now = system_unix_clock());

  // Nothing if the request may go on, else the 401 or 403. A cookie counts for an unsafe method only if the
  // browser says that the request comes from our own pages.
  std::optional<Response> refuse(const Request& request) const;

  // POST /session: the Set-Cookie value for the right token, else nothing.
  std::optional<std::string> open_session(std::string_view token) const;
  // DELETE /session: forgets the request's session, if it has one; gives the Set-Cookie value that clears it.
  std::string close_session(const Request& request);

  // Origin or Sec-Fetch-Site shows that another site sent this.
  static bool cross_site(const Request& request);

 private:
  bool token_matches(std::string_view token) const;
  bool session_valid(std::string_view session) const;
  std::string_view session_of(const Request& request) const;
  std::string mac(std::string_view text) const;

  std::string token_;
  std::string cookie_name_;  // has a part of the token's digest: cookies don't tell ports apart
  UnixClock now_;
  mutable std::mutex mutex_;
  std::map<std::string, std::int64_t, std::less<>> revoked_;  // session -> expiry
};

}  // namespace ls::http
