#include "coordinator/http/auth.h"

#include <fmt/format.h>
#include <openssl/evp.h>
#include <openssl/hmac.h>
#include <openssl/rand.h>

#include <array>
#include <charconv>
#include <chrono>

#include "common/base/check.h"
#include "common/base/digest.h"
#include "common/base/secret.h"
#include "coordinator/http/limits.h"
#include "coordinator/http/problem.h"

namespace ls::http {
namespace {

bool iequals_prefix(std::string_view text, std::string_view lower_case_prefix) {
  if (text.size() < lower_case_prefix.size()) return false;
  for (std::size_t i = 0; i < lower_case_prefix.size(); ++i)
    if ((text[i] | 0x20) != (lower_case_prefix[i] | 0x20)) return false;
  return true;
}

bool unsafe(Method method) {
  return method != Method::get && method != Method::head && method != Method::options;
}

}  // namespace

UnixClock system_unix_clock() {
  return [] {
    const auto now = std::chrono::system_clock::now().time_since_epoch();
    return static_cast<std::int64_t>(std::chrono::duration_cast<std::chrono::seconds>(now).count());
  };
}

Auth::Auth(std::string token, UnixClock now)
    : token_(std::move(token)),
      cookie_name_("lightshaft_" + sha256("cookie name " + token_).hex().substr(0, 12)),
      now_(std::move(now)) {
  CHECK(!token_.empty(), "an empty token would let everybody in");
}

std::optional<Response> Auth::refuse(const Request& request) const {
  const std::string_view authorization = request.header("authorization");
  if (!authorization.empty()) {
    std::string_view token = authorization;
    if (iequals_prefix(token, "bearer ")) {
      token.remove_prefix(7);
      while (token.starts_with(' ')) token.remove_prefix(1);
      if (token_matches(token)) return std::nullopt;
    }
    return problem(401, "the bearer token is not the one in the coordinator's data folder (file 'token')");
  }
  const std::string_view session = session_of(request);
  if (session.empty())
    return problem(
        401,
        "send 'Authorization: Bearer TOKEN' (TOKEN: file 'token' in the coordinator's data folder), "
        "or trade it for a session cookie at POST /api/v1/session");
  if (!session_valid(session)) return problem(401, "the session has ended; log in again");
  const bool same_site = !request.header("origin").empty() || !request.header("sec-fetch-site").empty();
  if (unsafe(request.method) && (!same_site || cross_site(request)))
    return problem(403,
                   "a request that changes something counts with a session cookie only if it comes from this "
                   "coordinator's own pages (Origin header); scripts use the bearer token");
  return std::nullopt;
}

std::optional<std::string> Auth::open_session(std::string_view token) const {
  if (!token_matches(token)) return std::nullopt;
  std::array<unsigned char, 16> nonce{};
  CHECK(RAND_bytes(nonce.data(), static_cast<int>(nonce.size())) == 1, "the system's random numbers failed");
  std::string text = fmt::format("{}.", now_() + kSessionSeconds);
  for (const unsigned char byte : nonce) text += fmt::format("{:02x}", byte);
  return fmt::format("{}={}.{}; Path=/; HttpOnly; SameSite=Strict; Max-Age={}", cookie_name_, text, mac(text),
                     kSessionSeconds);
}

std::string Auth::close_session(const Request& request) {
  const std::string session(session_of(request));
  if (session_valid(session)) {
    const std::lock_guard lock(mutex_);
    const std::int64_t now = now_();
    std::erase_if(revoked_, [now](const auto& entry) { return entry.second < now; });
    if (revoked_.size() >= kMaxRevokedSessions) revoked_.erase(revoked_.begin());
    revoked_.emplace(session, now + kSessionSeconds);
  }
  return cookie_name_ + "=; Path=/; HttpOnly; SameSite=Strict; Max-Age=0";
}

bool Auth::cross_site(const Request& request) {
  const std::string_view site = request.header("sec-fetch-site");
  if (site == "cross-site" || site == "same-site") return true;
  const std::string_view origin = request.header("origin");
  if (origin.empty()) return false;
  // Only host and port are compared: a proxy in front may speak TLS where we don't.
  const std::size_t scheme = origin.find("://");
  return scheme == std::string_view::npos || origin.substr(scheme + 3) != request.header("host");
}

bool Auth::token_matches(std::string_view token) const { return equal_secret(token, token_); }

bool Auth::session_valid(std::string_view session) const {
  const std::size_t last = session.rfind('.');
  if (last == std::string_view::npos) return false;
  if (!equal_secret(session.substr(last + 1), mac(session.substr(0, last)))) return false;
  std::int64_t expiry = 0;
  std::from_chars(session.data(), session.data() + last, expiry);
  if (expiry <= now_()) return false;
  const std::lock_guard lock(mutex_);
  return revoked_.find(session) == revoked_.end();
}

std::string_view Auth::session_of(const Request& request) const {
  std::string_view rest = request.header("cookie");
  while (!rest.empty()) {
    const std::size_t end = rest.find(';');
    std::string_view pair = rest.substr(0, end);
    rest = end == std::string_view::npos ? std::string_view{} : rest.substr(end + 1);
    while (pair.starts_with(' ')) pair.remove_prefix(1);
    if (pair.size() > cookie_name_.size() && pair.starts_with(cookie_name_) &&
        pair[cookie_name_.size()] == '=')
      return pair.substr(cookie_name_.size() + 1);
  }
  return {};
}

std::string Auth::mac(std::string_view text) const {
  Digest out;
  unsigned size = 0;
  const std::string key = "session " + token_;
  CHECK(HMAC(EVP_sha256(), key.data(), static_cast<int>(key.size()),
             reinterpret_cast<const unsigned char*>(text.data()), text.size(), out.bytes.data(),
             &size) != nullptr,
        "HMAC failed");
  return out.hex();
}

}  // namespace ls::http
