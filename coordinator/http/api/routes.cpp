#include "coordinator/http/api/routes.h"

#include <array>

#include "common/scene/limits.h"
#include "coordinator/http/api/handlers.h"
#include "coordinator/http/message/limits.h"

namespace ls::http {
namespace {

constexpr Access kOpen = Access::open;
constexpr Access kToken = Access::token;
constexpr Access kSubmit = Access::submit;
constexpr BodyKind kNone = BodyKind::none;
constexpr BodyKind kWhole = BodyKind::buffered;

constexpr std::string_view kJson = "application/json";
constexpr std::string_view kPatchJson = "application/json application/merge-patch+json";
constexpr std::string_view kJobTypes = "application/json application/xml text/xml";
constexpr std::string_view kBundleTypes =
    "application/zip application/x-zip-compressed application/x-tar application/x-tar+gzip "
    "application/gzip application/x-gzip";

// Handles a request about one job: calls `handler` with the job's id, or answers with an error if the address
// names no job.
template <auto handler>
Response of_job(Api& api, const Request& request, const Params& params) {
  const auto id = job_of(request, params);
  return id ? handler(api, request, *id) : problem(id.error());
}

constexpr std::array kRoutes = {
    Route{Method::get, "/healthz", kOpen, Executor::here, kNone, 0, get_healthz},
    Route{Method::get, "/readyz", kOpen, Executor::quick, kNone, 0, get_readyz},
    Route{Method::get, "/metrics", Access::see, Executor::quick, kNone, 0, get_metrics},
    Route{Method::get, "/api/v1/openapi.json", kToken, Executor::here, kNone, 0, get_openapi},
    Route{Method::post, "/api/v1/session", kOpen, Executor::here, kWhole, kMaxSessionJson, post_session,
          kJson},
    Route{Method::get, "/api/v1/session", kToken, Executor::here, kNone, 0, get_session},
    Route{Method::del, "/api/v1/session", kOpen, Executor::here, kNone, 0, delete_session},
    Route{Method::get, "/api/v1/jobs", kToken, Executor::quick, kNone, 0, get_jobs},
    Route{Method::post, "/api/v1/jobs", kSubmit, Executor::slow, kWhole, scene::kMaxTextBytes, post_job,
          kJobTypes, kBundleTypes},
    Route{Method::get, "/api/v1/jobs/{id}", kToken, Executor::quick, kNone, 0, of_job<get_job>},
    Route{Method::patch, "/api/v1/jobs/{id}", kSubmit, Executor::quick, kWhole, kMaxControlJson,
          of_job<patch_job>, kPatchJson},
    Route{Method::del, "/api/v1/jobs/{id}", kSubmit, Executor::quick, kNone, 0, of_job<delete_job>},
    Route{Method::get, "/api/v1/jobs/{id}/image.exr", kToken, Executor::slow, kNone, 0,
          of_job<get_image_exr>},
    Route{Method::get, "/api/v1/jobs/{id}/image.png", kToken, Executor::slow, kNone, 0,
          of_job<get_image_png>},
    Route{Method::get, "/api/v1/jobs/{id}/thumbnail.png", kToken, Executor::slow, kNone, 0,
          of_job<get_thumbnail>},
    Route{Method::post, "/api/v1/jobs/{id}/again", kSubmit, Executor::slow, kWhole, kMaxControlJson,
          of_job<post_again>, kJson},
    Route{Method::post, "/api/v1/jobs/{id}/video", kSubmit, Executor::slow, kWhole, kMaxControlJson,
          of_job<post_video>, kJson},
    Route{Method::get, "/api/v1/jobs/{id}/video", kToken, Executor::quick, kNone, 0, of_job<get_video>},
    Route{Method::get, "/api/v1/jobs/{id}/video.mp4", kToken, Executor::slow, kNone, 0,
          of_job<get_video_mp4>},
    Route{Method::get, "/api/v1/jobs/{id}/error.png", kToken, Executor::slow, kNone, 0,
          of_job<get_error_png>},
    Route{Method::get, "/api/v1/jobs/{id}/samples.png", kToken, Executor::slow, kNone, 0,
          of_job<get_samples_png>},
    Route{Method::get, "/api/v1/jobs/{id}/layers", kToken, Executor::slow, kNone, 0, of_job<get_layers>},
    Route{Method::get, "/api/v1/jobs/{id}/pixels", kToken, Executor::slow, kNone, 0, of_job<get_pixels>},
    Route{Method::get, "/api/v1/jobs/{id}/report", kToken, Executor::slow, kNone, 0, of_job<get_report>},
    Route{Method::get, "/api/v1/jobs/{id}/report.html", kToken, Executor::slow, kNone, 0,
          of_job<get_report_page>},
    Route{Method::get, "/api/v1/jobs/{id}/convergence.csv", kToken, Executor::quick, kNone, 0,
          of_job<get_convergence>},
    Route{Method::get, "/api/v1/jobs/{id}/tiles", kToken, Executor::slow, kNone, 0, of_job<get_tiles>},
    Route{Method::get, "/api/v1/jobs/{id}/log", kToken, Executor::quick, kNone, 0, of_job<get_log>},
    Route{Method::get, "/api/v1/jobs/{id}/events", kToken, Executor::quick, kNone, 0, of_job<get_job_events>},
    Route{Method::get, "/api/v1/events", kToken, Executor::quick, kNone, 0, get_events},
    Route{Method::get, "/api/v1/tokens", Access::admin, Executor::quick, kNone, 0, get_tokens},
    Route{Method::post, "/api/v1/tokens", Access::admin, Executor::slow, kWhole, kMaxControlJson, post_token,
          kJson},
    Route{Method::del, "/api/v1/tokens/{token}", Access::admin, Executor::slow, kNone, 0, delete_token},
    Route{Method::get, "/api/v1/workers", kToken, Executor::quick, kNone, 0, get_workers},
    Route{Method::post, "/api/v1/blobs/missing", kToken, Executor::remote, kWhole, kMaxDigestList,
          post_blobs_missing, kJson},
    Route{Method::head, "/api/v1/blobs/{sha256}", kToken, Executor::remote, kNone, 0, head_blob},
    Route{Method::put, "/api/v1/blobs/{sha256}", kSubmit, Executor::slow, BodyKind::blob, 0, nullptr},
};

std::string_view next_part(std::string_view& pattern) {
  pattern.remove_prefix(1);  // '/'
  const std::string_view part = pattern.substr(0, pattern.find('/'));
  pattern.remove_prefix(part.size());
  return part;
}

std::optional<Params> match(std::string_view pattern, std::span<const std::string> segments) {
  Params params;
  for (const auto& segment : segments) {
    if (pattern.empty()) return std::nullopt;
    const std::string_view part = next_part(pattern);
    if (part.starts_with('{')) {
      if (segment.empty()) return std::nullopt;
      params.push_back(segment);
    } else if (part != segment) {
      return std::nullopt;
    }
  }
  if (!pattern.empty()) return std::nullopt;
  return params;
}

bool answers(const Route& route, Method method) {
  return route.method == method || (route.method == Method::get && method == Method::head);
}

void add(std::string& list, std::string_view name) {
  if (!list.empty()) list += ", ";
  list += name;
}

}  // namespace

std::span<const Route> routes() { return kRoutes; }

std::string_view to_string(Access access) {
  switch (access) {
    case Access::open:
      return "anybody";
    case Access::token:
      return "submit, read, admin";
    case Access::submit:
      return "submit, admin";
    case Access::see:
      return "read, admin";
    case Access::admin:
      return "admin";
  }
  return "";
}

bool allows(Access access, Role role) {
  if (access == Access::open || role == Role::admin) return true;
  if (role == Role::submit) return access == Access::token || access == Access::submit;
  if (role == Role::read) return access == Access::token || access == Access::see;
  return false;
}

std::optional<std::variant<Match, WrongMethod>> find_route(Method method,
                                                           std::span<const std::string> segments) {
  std::string allow;
  for (const auto& route : kRoutes) {
    auto params = match(route.pattern, segments);
    if (!params) continue;
    if (answers(route, method)) return Match{&route, std::move(*params)};
    add(allow, to_string(route.method));
    if (route.method == Method::get) add(allow, "HEAD");
  }
  if (allow.empty()) return std::nullopt;
  add(allow, "OPTIONS");
  return WrongMethod{std::move(allow)};
}

}  // namespace ls::http
