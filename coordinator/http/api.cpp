#include "coordinator/http/api.h"

#include <fmt/format.h>

#include <charconv>
#include <exception>

#include "common/base/log.h"
#include "coordinator/http/handlers.h"
#include "coordinator/http/problem.h"

namespace ls::http {
namespace {

bool lists(std::string_view words, std::string_view word) {
  while (!words.empty()) {
    const std::size_t end = words.find(' ');
    if (words.substr(0, end) == word) return true;
    words = end == std::string_view::npos ? std::string_view{} : words.substr(end + 1);
  }
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
  std::string path;
  for (const auto& segment : request.segments) path += "/" + segment;
  return problem(404, fmt::format("there is nothing at '{}'; the routes are in /api/v1/openapi.json",
                                  path.empty() ? "/" : path.substr(0, 200)));
}

Response options_response(const std::string& allow) {
  Response response;
  response.status = 204;
  response.headers.emplace_back("Allow", allow);
  return response;
}

}  // namespace

Api::Api(coordinator::Coordinator& coordinator, std::string token, Limits limits, StaticFiles files)
    : coordinator_(coordinator), auth_(std::move(token)), limits_(limits), files_(std::move(files)) {}

std::variant<Response, Match> Api::admit(const Request& request) const {
  auto found = find_route(request.method, request.segments);
  if (!found) {
    const bool reads = request.method == Method::get || request.method == Method::head;
    const auto file = files_.find(request);
    if (file && request.method == Method::options) return options_response("GET, HEAD, OPTIONS");
    if (file && reads) return *file;
    if (file) {
      Response response = problem(405, "this is a page: GET or HEAD it");
      response.headers.emplace_back("Allow", "GET, HEAD, OPTIONS");
      return response;
    }
    // Under /api only those with a token learn what exists.
    if (!request.segments.empty() && request.segments.front() == "api")
      if (auto refused = auth_.refuse(request)) return *refused;
    return not_found(request);
  }
  if (auto* wrong = std::get_if<WrongMethod>(&*found)) {
    if (request.method == Method::options) return options_response(wrong->allow);
    Response response = problem(
        405, fmt::format("{} is not possible here; possible: {}", to_string(request.method), wrong->allow));
    response.headers.emplace_back("Allow", wrong->allow);
    return response;
  }
  Match& match = std::get<Match>(*found);
  if (match.route->access == Access::token)
    if (auto refused = auth_.refuse(request)) return *refused;
  if (auto refused = refuse_body(*match.route, request)) return *refused;
  return std::move(match);
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
  const bool is_job = route.body_limit == kMaxSceneXml;
  return is_job && media_type(request.header("content-type")) == "application/json" ? kMaxJobJson
                                                                                    : route.body_limit;
}

std::variant<Response, std::unique_ptr<BodySink>> Api::open_upload(const Match& match,
                                                                   const Request& request) {
  return body_kind(*match.route, request) == BodyKind::archive ? open_bundle(*this, request)
                                                               : open_blob(*this, request, match.params);
}

Response Api::handle(const Match& match, const Request& request) {
  return guarded(match.route->pattern, [&] { return match.route->handler(*this, request, match.params); });
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
  if (id.empty() || id.size() > kMaxIdLength) return false;
  for (const char c : id) {
    const bool ok =
        (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '-' || c == '_';
    if (!ok) return false;
  }
  return true;
}

Result<JobId> job_of(const Request& request, const Params& params) {
  const JobId id{params.empty() ? std::string() : params[0]};
  if (!plausible_id(id.value)) return fail(Errc::not_found, "there is no such job");
  const auto text = request.parameter("frame");
  if (!text) return id;
  std::uint32_t frame = 0;
  const auto [end, error] = std::from_chars(text->data(), text->data() + text->size(), frame);
  if (error != std::errc{} || end != text->data() + text->size() || frame > kMaxFrameNumber)
    return fail(Errc::invalid_argument, "'frame' must be the number of a frame");
  return coordinator::frame_job(id, frame);
}

}  // namespace ls::http
