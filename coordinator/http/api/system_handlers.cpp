#include <charconv>

#include "coordinator/http/api/api.h"
#include "coordinator/http/api/handlers.h"
#include "coordinator/http/auth/visible.h"
#include "coordinator/http/message/json_read.h"
#include "coordinator/http/message/problem.h"
#include "coordinator/views/views.h"

namespace ls::http {
namespace {

Response no_content(std::string set_cookie) {
  Response response;
  response.status = 204;
  response.headers.emplace_back("Set-Cookie", std::move(set_cookie));
  return response;
}

Response event_stream(const Request& request, std::string job) {
  EventStream stream;
  stream.job = std::move(job);
  stream.reader = request.caller;
  // Browsers send the header Last-Event-ID when they reconnect; its id is newer than that in the address.
  std::string_view text = request.header("last-event-id");
  if (text.empty()) text = request.parameter("last_event_id").value_or("");
  if (!text.empty()) {
    std::uint64_t id = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), id);
    if (error != std::errc{} || end != text.data() + text.size())
      return problem(400, "Last-Event-ID must be the id of an event: a whole number");
    stream.after_id = id;
  }
  Response response;
  response.content_type = "text/event-stream";
  response.events = std::move(stream);
  return response;
}

}  // namespace

Response get_healthz(Api&, const Request&, const Params&) { return text_response(200, "text/plain", "ok\n"); }

Response get_readyz(Api& api, const Request&, const Params&) {
  std::string why_not;
  if (!api.coordinator().ready(&why_not)) return problem(503, "not ready: " + why_not);
  // Jobs continue while Redis is unavailable: report it, but do not divert clients.
  const std::string trouble = api.coordinator().store_status().trouble;
  return text_response(200, "text/plain", trouble.empty() ? "ready\n" : "ready, but: " + trouble + "\n");
}

Response get_metrics(Api& api, const Request&, const Params&) {
  auto& coordinator = api.coordinator();
  return text_response(
      200, "text/plain; version=0.0.4; charset=utf-8",
      metrics_text(coordinator.jobs(), coordinator.workers(), coordinator.last_event_id(), api.counters(),
                   coordinator.store_status(), coordinator.figures(), coordinator.audits(), api.webhooks()));
}

Response get_openapi(Api&, const Request&, const Params&) {
  return json_response(200, std::string(embedded_openapi()));
}

Response get_session(Api&, const Request& request, const Params&) {
  const Caller& caller = request.caller;
  return json_response(200, write_json({{"role", to_string(caller.role)}, {"user", caller.user}}));
}

Response post_session(Api& api, const Request& request, const Params&) {
  if (Auth::cross_site(request))
    return problem(403, "a session can be opened only from this coordinator's own pages");
  const auto body = read_object(request.body, {"token"});
  if (!body) return problem(body.error());
  const auto token = body->find("token");
  if (token == body->end() || !token->is_string())
    return problem(400, "the body must be {\"token\": \"...\"}");
  auto cookie = api.auth().open_session(request, token->get_ref<const std::string&>());
  if (auto* refused = std::get_if<Response>(&cookie)) return std::move(*refused);
  return no_content(std::move(std::get<std::string>(cookie)));
}

Response delete_session(Api& api, const Request& request, const Params&) {
  if (Auth::cross_site(request))
    return problem(403, "a session can be closed only from this coordinator's own pages");
  return no_content(api.auth().close_session(request));
}

Response get_workers(Api& api, const Request& request, const Params&) {
  auto workers = api.coordinator().workers();
  for (auto& worker : workers) {
    if (request.caller.role != Role::submit) continue;
    // A worker without a job is hidden, too: its status may reveal what it did for others (why it failed, or
    // is quarantined).
    const auto owner = api.coordinator().owner(JobId{worker.job});
    if (!owner || !request.caller.sees(*owner)) hide_work(worker);
  }
  return json_response(200, coordinator::workers_json(workers));
}

Response get_events(Api&, const Request& request, const Params&) { return event_stream(request, {}); }

Response get_job_events(Api& api, const Request& request, const Params& params) {
  const auto id = job_of(request, params);
  if (!id) return problem(id.error());
  if (const auto job = api.coordinator().job(*id); !job) return problem(job.error());
  return event_stream(request, id->value);
}

}  // namespace ls::http
