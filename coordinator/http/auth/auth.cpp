#include "coordinator/http/auth/auth.h"

#include <fmt/format.h>
#include <strings.h>

#include <charconv>
#include <nlohmann/json.hpp>

#include "coordinator/http/message/limits.h"
#include "core/base/check.h"
#include "core/base/clock.h"
#include "core/base/digest.h"
#include "core/base/secret.h"

namespace ls::http {
namespace {

constexpr std::size_t kNonceDigits = 32;  // hexadecimal digits of the nonce in a cookie

bool unsafe(Method method) {
  return method != Method::get && method != Method::head && method != Method::options;
}

}  // namespace

UnixClock system_unix_clock() {
  return [] { return system_unix_ns() / 1'000'000'000; };
}

Auth::Auth(const TokenRegistry& tokens, Options options, UnixClock now)
    : tokens_(tokens),
      options_(options),
      cookie_name_("lightshaft_" + sha256("cookie name " + tokens.session_key()).hex().substr(0, 12)),
      now_(std::move(now)),
      throttle_(options.requests, options.failures),
      closed_(tokens.folder()) {}

std::variant<Caller, Response> Auth::identify(const Request& request) {
  const std::string_view authorization = request.header("authorization");
  if (!authorization.empty()) {
    constexpr std::string_view kWrong =
        "the bearer token is none that this coordinator knows (the admin's is in its data folder, file "
        "'token')";
    std::string_view token = authorization;
    if (token.size() < 7 || ::strncasecmp(token.data(), "bearer ", 7) != 0) return problem(401, kWrong);
    token.remove_prefix(7);
    while (token.starts_with(' ')) token.remove_prefix(1);
    return caller_of_token(request, token, kWrong);
  }
  const std::string_view session = session_of(request);
  if (session.empty())
    return problem(
        401,
        "send 'Authorization: Bearer TOKEN' (the admin's: file 'token' in the coordinator's data folder), "
        "or trade it for a session cookie at POST /api/v1/session");
  const auto open = parse_session(session);
  auto caller = open && !is_closed(*open) ? tokens_.by_id(open->token_id) : std::nullopt;
  if (!caller) return problem(401, "the session has ended; log in again");
  const bool same_site = !request.header("origin").empty() || !request.header("sec-fetch-site").empty();
  if (unsafe(request.method) && (!same_site || cross_site(request)))
    return problem(403,
                   "a request that changes something counts with a session cookie only if it comes from this "
                   "coordinator's own pages (Origin header); scripts use the bearer token");
  return std::move(*caller);
}

std::variant<Caller, Response> Auth::caller_of_token(const Request& request, std::string_view token,
                                                     std::string_view wrong) {
  const std::string address = Throttle::group_of(request.peer);
  const std::int64_t now = now_();
  auto caller = tokens_.find(token);
  if (const int wait = throttle_.may_try(address, caller ? caller->token_id : "", now); wait > 0)
    return too_many(wait, "too many wrong tokens came from your address; wait, then try again");
  if (!caller) {
    throttle_.failed(address, now);
    return problem(401, wrong);
  }
  throttle_.succeeded(address, caller->token_id, now);
  if (caller->role == Role::join) return problem(403, "this is a worker's join token: it opens nothing here");
  return std::move(*caller);
}

std::optional<Response> Auth::too_often(const Request& request, const Caller* caller) {
  const std::string who = caller ? "token " + caller->token_id : Throttle::group_of(request.peer);
  const int wait = throttle_.request(who, now_());
  if (wait == 0) return std::nullopt;
  return too_many(wait, fmt::format("more than {} requests a second; wait as long as Retry-After says",
                                    options_.requests.per_second));
}

bool Auth::still_valid(const Caller& caller) const { return tokens_.by_id(caller.token_id).has_value(); }

std::variant<std::string, Response> Auth::open_session(const Request& request, std::string_view token) {
  auto caller = caller_of_token(
      request, token,
      "this is no token of this coordinator (the admin's is in its data folder, file 'token')");
  if (auto* refused = std::get_if<Response>(&caller)) return std::move(*refused);
  const auto nonce = random_token();
  CHECK(nonce, "the system's random numbers failed");
  const std::string text = fmt::format("{}.{}.{}", now_() + kSessionSeconds, nonce->substr(0, kNonceDigits),
                                       std::get<Caller>(caller).token_id);
  return cookie(text + "." + mac(text), kSessionSeconds);
}

std::string Auth::cookie(std::string_view value, std::int64_t seconds) const {
  return fmt::format("{}={}; Path=/; HttpOnly; SameSite=Strict; Max-Age={}{}", cookie_name_, value, seconds,
                     options_.secure ? "; Secure" : "");
}

std::string Auth::close_session(const Request& request) {
  if (const auto session = parse_session(session_of(request)); session && !is_closed(*session))
    closed_.close(session->token_id, session->expiry, session->text, now_());
  return cookie("", 0);
}

bool Auth::cross_site(const Request& request) {
  const std::string_view site = request.header("sec-fetch-site");
  if (site == "cross-site" || site == "same-site") return true;
  const std::string_view origin = request.header("origin");
  if (origin.empty()) return false;
  // Compares host and port but not the scheme, since a proxy may receive TLS and forward plain HTTP.
  const std::size_t scheme = origin.find("://");
  return scheme == std::string_view::npos || origin.substr(scheme + 3) != request.header("host");
}

std::optional<Auth::Session> Auth::parse_session(std::string_view cookie) const {
  const std::size_t last = cookie.rfind('.');
  if (last == std::string_view::npos) return std::nullopt;
  const std::string_view text = cookie.substr(0, last);
  if (!equal_secret(cookie.substr(last + 1), mac(text))) return std::nullopt;
  Session session{.text = text, .token_id = text.substr(text.rfind('.') + 1)};
  std::from_chars(text.data(), text.data() + text.size(), session.expiry);
  return session.expiry > now_() ? std::optional(session) : std::nullopt;
}

bool Auth::is_closed(const Session& session) const {
  return closed_.contains(session.token_id, session.expiry, session.text);
}

std::string_view Auth::session_of(const Request& request) const {
  for (std::string_view rest = request.header("cookie"); !rest.empty();) {
    std::string_view value = take_part(rest, ';');
    while (value.starts_with(' ')) value.remove_prefix(1);
    if (value.starts_with(cookie_name_ + "=")) return value.substr(cookie_name_.size() + 1);
  }
  return {};
}

std::string Auth::mac(std::string_view text) const {
  std::string out = hmac_sha256(tokens_.session_key(), text);
  CHECK(!out.empty(), "HMAC failed");
  return out;
}

void hide_work(coordinator::WorkerView& worker) {
  worker.job.clear();
  worker.activity.clear();
}

std::optional<coordinator::StreamEvent> visible(const coordinator::StreamEvent& event, const Caller& caller) {
  if (caller.role != Role::submit) return event;
  if (event.type != "worker") return caller.sees(event.owner) ? std::optional(event) : std::nullopt;
  auto worker = nlohmann::json::parse(event.data, nullptr, false);
  if (!worker.is_object()) return std::nullopt;
  const auto job = worker.find("job");
  if (job == worker.end()) return std::nullopt;
  if (!job->is_null() && caller.sees(event.owner)) return event;
  coordinator::StreamEvent hidden = event;
  *job = nullptr;
  worker["activity"] = "";
  hidden.data = worker.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
  return hidden;
}

}  // namespace ls::http
