#include "coordinator/http/api/routes.h"

#include <array>

#include "coordinator/http/api/handlers.h"
#include "coordinator/http/message/limits.h"
#include "core/scene/limits.h"

namespace ls::http {
namespace {

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

// A route for requests without a body.
constexpr Route plain(Method method, std::string_view pattern, Access access, Executor executor,
                      Handler handler) {
  return {method, pattern, access, executor, BodyKind::none, 0, handler};
}

// A route for what is made of a job's whole image.
constexpr Route picture(std::string_view pattern, Handler handler) {
  return {Method::get, pattern, Access::token, Executor::slow, BodyKind::none, 0, handler, {}, {}, true};
}

constexpr auto kRoutes = [] {
  using enum Method;
  using enum Access;
  using enum Executor;
  using enum BodyKind;
  return std::array{
      plain(get, "/healthz", open, here, get_healthz),
      plain(get, "/readyz", open, quick, get_readyz),
      plain(get, "/metrics", see, quick, get_metrics),
      plain(get, "/api/v1/openapi.json", token, here, get_openapi),
      Route{post, "/api/v1/session", open, here, buffered, kMaxSessionJson, post_session, kJson},
      plain(get, "/api/v1/session", token, here, get_session),
      plain(del, "/api/v1/session", open, quick, delete_session),
      plain(get, "/api/v1/jobs", token, quick, get_jobs),
      Route{post, "/api/v1/jobs", submit, slow, buffered, scene::kMaxTextBytes, post_job, kJobTypes,
            kBundleTypes},
      plain(get, "/api/v1/jobs/{id}", token, quick, of_job<get_job>),
      Route{patch, "/api/v1/jobs/{id}", submit, quick, buffered, kMaxControlJson, of_job<patch_job>,
            kPatchJson},
      plain(del, "/api/v1/jobs/{id}", submit, quick, of_job<delete_job>),
      picture("/api/v1/jobs/{id}/image.exr", of_job<get_image_exr>),
      picture("/api/v1/jobs/{id}/deep.exr", of_job<get_deep_exr>),
      picture("/api/v1/jobs/{id}/image.png", of_job<get_image_png>),
      picture("/api/v1/jobs/{id}/mix", of_job<get_mix>),
      picture("/api/v1/jobs/{id}/thumbnail.png", of_job<get_thumbnail>),
      Route{post, "/api/v1/jobs/{id}/again", submit, slow, buffered, kMaxControlJson, of_job<post_again>,
            kJson},
      Route{post, "/api/v1/jobs/{id}/video", submit, slow, buffered, kMaxControlJson, of_job<post_video>,
            kJson},
      plain(get, "/api/v1/jobs/{id}/video", token, quick, of_job<get_video>),
      plain(get, "/api/v1/jobs/{id}/video.mp4", token, slow, of_job<get_video_mp4>),
      picture("/api/v1/jobs/{id}/error.png", of_job<get_error_png>),
      picture("/api/v1/jobs/{id}/samples.png", of_job<get_samples_png>),
      picture("/api/v1/jobs/{id}/layers", of_job<get_layers>),
      picture("/api/v1/jobs/{id}/pixels", of_job<get_pixels>),
      picture("/api/v1/jobs/{id}/meters", of_job<get_meters>),
      picture("/api/v1/jobs/{id}/report", of_job<get_report>),
      picture("/api/v1/jobs/{id}/report.html", of_job<get_report_page>),
      plain(get, "/api/v1/jobs/{id}/convergence.csv", token, quick, of_job<get_convergence>),
      picture("/api/v1/jobs/{id}/tiles", of_job<get_tiles>),
      plain(get, "/api/v1/jobs/{id}/log", token, quick, of_job<get_log>),
      plain(get, "/api/v1/announced", token, quick, get_announced),
      Route{put, "/api/v1/announced/{announcement}", submit, quick, buffered, kMaxControlJson, put_announced,
            kJson},
      plain(del, "/api/v1/announced/{announcement}", submit, quick, delete_announced),
      plain(get, "/api/v1/jobs/{id}/events", token, quick, of_job<get_job_events>),
      plain(get, "/api/v1/events", token, quick, get_events),
      plain(get, "/api/v1/views", token, here, get_views),
      plain(get, "/api/v1/views/cube", token, slow, get_view_cube),
      plain(get, "/api/v1/tokens", admin, quick, get_tokens),
      Route{post, "/api/v1/tokens", admin, slow, buffered, kMaxControlJson, post_token, kJson},
      plain(del, "/api/v1/tokens/{token}", admin, slow, delete_token),
      plain(get, "/api/v1/workers", token, quick, get_workers),
      Route{patch, "/api/v1/workers/{worker}", admin, quick, buffered, kMaxControlJson, patch_worker, kJson},
      plain(get, "/api/v1/workers/{worker}/log", see, quick, get_worker_log),
      Route{post, "/api/v1/blobs/missing", token, remote, buffered, kMaxDigestList, post_blobs_missing,
            kJson},
      plain(head, "/api/v1/blobs/{sha256}", token, remote, head_blob),
      Route{put, "/api/v1/blobs/{sha256}", submit, slow, blob, 0, nullptr}};
}();

std::string_view next_part(std::string_view& pattern) {
  pattern.remove_prefix(1);  // the '/' before the part
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
  constexpr std::string_view kCallers[] = {"anybody", "submit, read, admin", "submit, admin", "read, admin",
                                           "admin"};
  return kCallers[static_cast<std::size_t>(access)];
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
