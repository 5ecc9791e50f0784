#include "coordinator/http/api/api.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <exception>

#include "coordinator/http/api/content_coding.h"
#include "coordinator/http/api/handlers.h"
#include "core/base/log.h"
#include "core/base/parse_number.h"
#include "core/base/safe_text.h"
#include "core/scene/limits.h"
#include "util/protocol/limits.h"

namespace ls::http {
namespace {

bool lists(std::string_view words, std::string_view word) {
  while (!words.empty())
    if (take_part(words, ' ') == word) return true;
  return false;
}

Response unsupported_type(const Route& route, std::string_view type) {
  std::string accepted(route.accepts);
  if (!route.unpacks.empty()) accepted.append(" ").append(route.unpacks);
  for (std::size_t at = 0; (at = accepted.find(' ', at)) != std::string::npos; at += 2)
    accepted.replace(at, 1, ", ");
  return problem(
      415, fmt::format("Content-Type is {}; accepted here: {}", type.empty() ? "missing" : type, accepted));
}

Response not_found(const Request& request) {
  return problem(404, fmt::format("there is nothing at '{}'; the routes are in /api/v1/openapi.json",
                                  fmt::format("/{}", fmt::join(request.segments, "/")).substr(0, 200)));
}

constexpr std::string_view kOneJob = "/api/v1/jobs/{id}";

std::string target_of(const Request& request) {
  std::string target;
  for (const auto& segment : request.segments) target += "/" + percent_encode(segment);
  for (const auto& [name, value] : request.query)
    target += fmt::format("{}{}={}", target.find('?') == std::string::npos ? '?' : '&', percent_encode(name),
                          percent_encode(value));
  return target;
}

// Returns a redirect to the coordinator that has the job; a 503 if that coordinator does not answer, or if it
// cannot be found out now which one has the job; nullopt if no coordinator has the job.
std::optional<Response> at_its_owner(coordinator::Coordinator& coordinator, const Request& request,
                                     const Params& params) {
  if (params.empty() || !plausible_id(params[0])) return std::nullopt;
  const auto owner = coordinator.locate_job({params[0]});
  if (!owner)
    return problem(503, "which coordinator has this job cannot be found out now: " + owner.error().message);
  if (!*owner) return std::nullopt;
  if (!(*owner)->alive || (*owner)->http.empty())
    return problem(
        503,
        "the coordinator that has this job does not answer; unless the job has ended, another one takes "
        "it over within seconds: ask again");
  return problem(307, "another coordinator has this job; its address is in Location",
                 {{"Location", (*owner)->http + target_of(request)}});
}

Response options_response(const std::string& allow) { return {.status = 204, .headers = {{"Allow", allow}}}; }

}  // namespace

Api::Api(coordinator::Coordinator& coordinator, TokenRegistry& tokens, Limits limits, StaticFiles files,
         bool secure)
    : coordinator_(coordinator),
      tokens_(tokens),
      auth_(tokens, {{limits.requests_per_second, std::max(1.0, 2 * limits.requests_per_second)},
                     {limits.wrong_tokens_per_minute / 60, std::max(1.0, limits.wrong_tokens_per_minute)},
                     secure}),
      limits_(limits),
      files_(std::move(files)),
      pictures_({.places = limits.slow.threads,
                 .places_each = limits.slow.each,
                 .bytes = limits.picture_memory,
                 .bytes_each = limits.picture_memory / 2}) {}

std::variant<Response, Match> Api::admit(Request& request) {
  auto found = admit_route(request);
  // If the caller was identified, the limit on its requests has been applied already. All other requests are
  // limited here, by address.
  if (request.caller.token_id.empty())
    if (auto refused = auth_.too_often(request, nullptr)) return *refused;
  return found;
}

std::variant<Response, Match> Api::admit_route(Request& request) {
  auto found = find_route(request.method, request.segments);
  if (!found) {
    const bool reads = request.method == Method::get || request.method == Method::head;
    const auto file = files_.find(request);
    if (file && request.method == Method::options) return options_response("GET, HEAD, OPTIONS");
    if (file && reads) return *file;
    if (file) return problem(405, "this is a page: GET or HEAD it", {{"Allow", "GET, HEAD, OPTIONS"}});
    // Under /api a caller without a token gets a 401 even for an unknown address, so the 404 does not reveal
    // to strangers which routes exist.
    if (!request.segments.empty() && request.segments.front() == "api")
      if (auto refused = refuse_caller(Access::token, request)) return *refused;
    return not_found(request);
  }
  if (auto* wrong = std::get_if<WrongMethod>(&*found)) {
    if (request.method == Method::options) return options_response(wrong->allow);
    return problem(
        405, fmt::format("{} is not possible here; possible: {}", to_string(request.method), wrong->allow),
        {{"Allow", wrong->allow}});
  }
  Match& match = std::get<Match>(*found);
  if (auto refused = refuse_caller(match.route->access, request)) return *refused;
  if (auto refused = refuse_body(*match.route, request)) return *refused;
  return std::move(match);
}

std::optional<Response> Api::refuse_caller(Access access, Request& request) {
  if (access == Access::open) return std::nullopt;
  auto caller = auth_.identify(request);
  if (auto* refused = std::get_if<Response>(&caller)) return std::move(*refused);
  request.caller = std::move(std::get<Caller>(caller));
  if (auto refused = auth_.too_often(request, &request.caller)) return refused;
  if (allows(access, request.caller.role)) return std::nullopt;
  return problem(403, fmt::format("a token of the role '{}' may not do this; it takes: {}",
                                  to_string(request.caller.role), to_string(access)));
}

std::optional<Response> Api::refuse_job(const Match& match, const Request& request) const {
  if (request.caller.role != Role::submit || !match.route->pattern.starts_with(kOneJob)) return std::nullopt;
  const auto id = job_of(request, match.params);
  if (!id && id.error().code != Errc::not_found) return problem(id.error());
  const auto owner = id ? coordinator_.owner(*id) : tl::unexpected(id.error());
  if (owner && request.caller.sees(*owner)) return std::nullopt;
  return problem(404, fmt::format("'{}' has no such job", request.caller.user));
}

std::optional<Response> Api::refuse_body(const Route& route, const Request& request) const {
  if (route.body == BodyKind::none) return std::nullopt;
  const std::string type = media_type(request.header("content-type"));
  if (body_kind(route, request) == BodyKind::buffered && !lists(route.accepts, type))
    return unsupported_type(route, type);
  const std::uint64_t limit = body_limit(route, request);
  if (request.content_length.value_or(0) > limit)
    return problem(413, fmt::format("the body has {} bytes; at most {} are accepted here",
                                    *request.content_length, limit));
  return std::nullopt;
}

BodyKind Api::body_kind(const Route& route, const Request& request) const {
  if (route.unpacks.empty()) return route.body;
  return lists(route.unpacks, media_type(request.header("content-type"))) ? BodyKind::archive : route.body;
}

std::uint64_t Api::body_limit(const Route& route, const Request& request) const {
  const BodyKind kind = body_kind(route, request);
  if (kind == BodyKind::blob) return limits_.blob_bytes;
  if (kind == BodyKind::archive) return limits_.bundle_bytes;
  const bool is_job = route.body_limit == scene::kMaxTextBytes;
  return is_job && media_type(request.header("content-type")) == "application/json" ? kMaxJobJson
                                                                                    : route.body_limit;
}

std::variant<Response, std::unique_ptr<BodySink>> Api::open_upload(const Match& match,
                                                                   const Request& request) {
  return body_kind(*match.route, request) == BodyKind::archive ? open_bundle(*this, request)
                                                               : open_blob(*this, request, match.params);
}

Response Api::handle(const Match& match, const Request& request) {
  return guarded(match.route->pattern, [&] {
    if (auto refused = refuse_job(match, request)) return std::move(*refused);
    std::optional<coordinator::Gate::Place> turn;
    if (match.route->of_pixels) {
      const auto id = job_of(request, match.params);
      turn.emplace(pictures_, request.caller.token_id,
                   id ? coordinator_.picture_bytes(*id, kMemoryPerPixel) : 0);
    }
    Response response = match.route->handler(*this, request, match.params);
    if (request.method == Method::get) compress(response, request);
    return response;
  });
}

// Only jobs that this coordinator does not have are looked up at others; the job's own coordinator then
// checks access. For a job that is here but invisible to the caller, the 404 stays.
bool Api::may_be_another_coordinators(const Match& match, const Response& response) const {
  return response.status == 404 && match.route->pattern.starts_with(kOneJob) && !match.params.empty() &&
         !coordinator_.owner(JobId{match.params[0]});
}

Response Api::ask_other_coordinator(const Match& match, const Request& request, Response response) {
  return guarded(match.route->pattern, [&] {
    auto other = at_its_owner(coordinator_, request, match.params);
    return other ? std::move(*other) : std::move(response);
  });
}

Response guarded(std::string_view what, const std::function<Response()>& work) {
  try {
    return work();
  } catch (const std::bad_alloc&) {
    return problem(503, "the coordinator has not enough memory for this request now");
  } catch (const std::exception& e) {
    log_error(fmt::format("route={}", what), e.what());
    return problem(500, fmt::format("a bug of the coordinator: {}", e.what()));
  }
}

bool plausible_id(std::string_view id) {
  return !id.empty() && id.size() <= limits::kIdBytes && std::all_of(id.begin(), id.end(), [](char c) {
    return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '-' || c == '_';
  });
}

Result<JobId> job_of(const Request& request, const Params& params) {
  const JobId id{params.empty() ? std::string() : params[0]};
  if (!plausible_id(id.value)) return fail(Errc::not_found, "there is no such job");
  const auto text = request.parameter("frame");
  if (!text) return id;
  const auto frame = parse_number<std::uint32_t>(*text);
  if (!frame || *frame > kMaxFrameNumber)
    return fail(Errc::invalid_argument, "'frame' must be the number of a frame");
  return coordinator::frame_job(id, *frame);
}

}  // namespace ls::http
