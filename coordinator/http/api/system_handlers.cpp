#include <fmt/format.h>

#include <bit>
#include <cstdint>
#include <nlohmann/json.hpp>

#include "coordinator/http/api/api.h"
#include "coordinator/http/api/handlers.h"
#include "coordinator/http/auth/auth.h"
#include "coordinator/http/message/json_read.h"
#include "coordinator/views/views.h"
#include "core/base/parse_number.h"

namespace ls::http {
namespace {

Response no_content(std::string set_cookie) {
  return {.status = 204, .headers = {{"Set-Cookie", std::move(set_cookie)}}};
}

Response event_stream(const Request& request, std::string job) {
  EventStream stream;
  stream.job = std::move(job);
  stream.reader = request.caller;
  // The parameter last_event_id is part of the address and stays as it is when a browser reconnects. The
  // header Last-Event-ID, which the browser then sends, has the id of the last event that it got. So the
  // header takes precedence.
  std::string_view text = request.header("last-event-id");
  if (text.empty()) text = request.parameter("last_event_id").value_or("");
  if (!text.empty()) {
    stream.after_id = parse_number<std::uint64_t>(text);
    if (!stream.after_id) return problem(400, "Last-Event-ID must be the id of an event: a whole number");
  }
  return {.content_type = "text/event-stream", .events = std::move(stream)};
}

nlohmann::ordered_json to_value(const TokenInfo& token) {
  return {
      {"id", token.id}, {"role", to_string(token.role)}, {"user", token.user}, {"of_file", token.of_file}};
}

}  // namespace

Response get_healthz(Api&, const Request&, const Params&) { return text_response(200, "text/plain", "ok\n"); }

Response get_readyz(Api& api, const Request&, const Params&) {
  std::string why_not;
  if (!api.coordinator().ready(&why_not)) return problem(503, "not ready: " + why_not);
  if (const std::string port = api.workers_port_trouble(); !port.empty())
    return problem(503, "not ready: " + port);
  // Jobs continue while Redis is unavailable, so the coordinator reports the trouble but stays ready for
  // clients.
  const std::string trouble = api.coordinator().store_status().trouble;
  return text_response(200, "text/plain", trouble.empty() ? "ready\n" : "ready, but: " + trouble + "\n");
}

Response get_views(Api& api, const Request&, const Params&) {
  const DisplayViews* views = api.coordinator().display_views();
  const std::string plain(kPlainView);
  const nlohmann::json out = {{"default", views != nullptr ? views->standard() : plain},
                              {"views", views != nullptr ? views->names() : std::vector{plain}}};
  return json_response(200, out.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace));
}

Response get_view_cube(Api& api, const Request& request, const Params&) {
  const auto name = request.parameter("view");
  if (!name) return problem(400, "'view' is missing: the name of a view of GET /api/v1/views");
  const auto cube = api.coordinator().view_cube(std::string(*name));
  if (!cube) return problem(cube.error());
  static_assert(std::endian::native == std::endian::little);
  std::string bytes(reinterpret_cast<const char*>(cube->data()), 2 * cube->size());
  return {.content_type = "application/octet-stream", .body = std::move(bytes)};
}

Response get_openapi(Api&, const Request&, const Params&) {
  return json_response(200, std::string(embedded_openapi()));
}

Response get_session(Api&, const Request& request, const Params&) {
  const Caller& caller = request.caller;
  return json_response(
      200,
      write_json({{"role", to_string(caller.role)}, {"user", caller.user}, {"version", LIGHTSHAFT_VERSION}}));
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
    // The activity of a worker without a job is hidden, too: it may tell why the worker failed or is
    // quarantined, and so reveal earlier jobs of other users.
    const auto owner = api.coordinator().owner(JobId{worker.job});
    if (!owner || !request.caller.sees(*owner)) hide_work(worker);
  }
  auto answer = nlohmann::json::parse(coordinator::workers_json(workers));
  const Joining& join = api.joining();
  answer["join"] = {{"address", join.address}, {"tls", join.tls}};
  // Where a secret lies is told only to those who may read everything else, too.
  if (request.caller.role == Role::admin) answer["join"]["token_file"] = join.token_file;
  return json_response(200, answer.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace));
}

// A worker can be asked to end after its units, or to restart after them; and, until it has, to stay.
Response patch_worker(Api& api, const Request& request, const Params& params) {
  const auto body = read_object(request.body, {"state"});
  if (!body) return problem(body.error());
  const auto state = body->find("state");
  const std::string wanted = state != body->end() && state->is_string() ? state->get<std::string>() : "";
  const DrainNow how{.withdrawn = wanted == "connected", .restart = wanted == "restarting"};
  if (!how.withdrawn && !how.restart && wanted != "draining")
    return problem(
        400,
        "'state' must be \"draining\" (the worker finishes its units and ends), \"restarting\" (it "
        "finishes them and restarts its program) or \"connected\" (it stays)");
  const WorkerId id{params.empty() ? std::string() : params[0]};
  if (!plausible_id(id.value)) return problem(404, "there is no such worker");
  if (const auto done = api.coordinator().drain_worker(id, how); !done) return problem(done.error());
  return {.status = 202};
}

Response get_worker_log(Api& api, const Request&, const Params& params) {
  const WorkerId id{params.empty() ? std::string() : params[0]};
  if (!plausible_id(id.value)) return problem(404, "there is no such worker");
  auto log = api.coordinator().worker_log(id);
  return log ? text_response(200, "text/plain; charset=utf-8", std::move(*log)) : problem(log.error());
}

Response get_events(Api&, const Request& request, const Params&) { return event_stream(request, {}); }

Response get_job_events(Api& api, const Request& request, const JobId& id) {
  if (const auto job = api.coordinator().job(id); !job) return problem(job.error());
  return event_stream(request, id.value);
}

Response get_tokens(Api& api, const Request&, const Params&) {
  auto list = nlohmann::ordered_json::array();
  for (const TokenInfo& token : api.tokens().list()) list.push_back(to_value(token));
  return json_response(200, write_json({{"tokens", std::move(list)}}));
}

Response post_token(Api& api, const Request& request, const Params&) {
  const auto body = read_object(request.body, {"role", "user"});
  if (!body) return problem(body.error());
  const auto role = body->find("role");
  const auto known = role != body->end() && role->is_string()
                         ? parse_role(role->get_ref<const std::string&>())
                         : std::nullopt;
  if (!known) return problem(400, "'role' must be \"admin\", \"submit\", \"read\" or \"join\"");
  std::string user;
  if (const auto found = body->find("user"); found != body->end()) {
    if (!found->is_string()) return problem(400, "'user' must be a text");
    user = found->get<std::string>();
  }
  const auto made = api.tokens().add(*known, std::move(user));
  if (!made) return problem(made.error());
  auto value = to_value(made->info);
  value["token"] = made->token;
  Response response = json_response(201, write_json(value));
  response.headers.emplace_back("Location", "/api/v1/tokens/" + made->info.id);
  return response;
}

Response delete_token(Api& api, const Request&, const Params& params) {
  if (const auto done = api.tokens().revoke(params[0]); !done) return problem(done.error());
  return {.status = 204};
}

}  // namespace ls::http
