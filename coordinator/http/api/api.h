// From request to response, without sockets: routing, authentication, limits, handlers. The server loop
// (net/http_server.h) calls admit() when a header has arrived, then handle() with the whole body, or
// open_upload() and its sink.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <stop_token>
#include <variant>

#include "coordinator/http/api/metrics.h"
#include "coordinator/http/api/routes.h"
#include "coordinator/http/api/static_files.h"
#include "coordinator/http/auth/auth.h"
#include "coordinator/http/message/limits.h"
#include "coordinator/http/message/message.h"
#include "coordinator/service/coordinator.h"

namespace ls::http {

// Receives a streamed body. If destroyed before finish(), nothing of the body is kept, except of an upload in
// parts.
class BodySink {
 public:
  virtual ~BodySink() = default;
  // A response: stop reading and send this answer
  virtual std::optional<Response> append(std::span<const std::byte> bytes) = 0;
  virtual Response finish() = 0;
};

class Api {
 public:
  // `tokens` must outlive this. `secure`: requests arrive over TLS.
  Api(coordinator::Coordinator& coordinator, TokenRegistry& tokens, Limits limits, StaticFiles files,
      bool secure = false);

  // Returns the matching route, or the final answer: unknown address, missing or insufficient token, too many
  // requests, body too long, a static file. Sets request.caller.
  std::variant<Response, Match> admit(Request& request);
  // Most bytes that this request's body may have, with or without Content-Length.
  std::uint64_t body_limit(const Route& route, const Request& request) const;
  // How this request's body is handled: the route's kind, or `archive` if it has a media type that the route
  // unpacks.
  BodyKind body_kind(const Route& route, const Request& request) const;
  // Runs the route's handler; never throws.
  Response handle(const Match& match, const Request& request);
  // True if another coordinator may have the job behind this 404. Then call ask_other_coordinator(), which
  // may block for a second: it returns a redirect to that coordinator, 503 if that does not answer, or
  // `response` unchanged.
  bool may_be_another_coordinators(const Match& match, const Response& response) const;
  Response ask_other_coordinator(const Match& match, const Request& request, Response response);
  // For streamed bodies: BodyKind::blob and archive.
  std::variant<Response, std::unique_ptr<BodySink>> open_upload(const Match& match, const Request& request);
  // Makes long work end at its next step, because the coordinator stops.
  void ask_to_stop() { stop_.request_stop(); }
  std::stop_token stop_token() const { return stop_.get_token(); }

  coordinator::Coordinator& coordinator() { return coordinator_; }
  Auth& auth() { return auth_; }
  TokenRegistry& tokens() { return tokens_; }
  Counters& counters() { return counters_; }
  const Limits& limits() const { return limits_; }
  // Sets the source of the webhook counters in /metrics; call it before the first request. Without it there
  // are none.
  void webhooks(std::function<WebhookFigures()> figures) { webhooks_ = std::move(figures); }
  std::optional<WebhookFigures> webhooks() const {
    return webhooks_ ? std::optional(webhooks_()) : std::nullopt;
  }

 private:
  std::variant<Response, Match> admit_route(Request& request);
  std::optional<Response> refuse_caller(Access access, Request& request);
  std::optional<Response> refuse_body(const Route& route, const Request& request) const;
  // 404 if a submit token asks for another user's job: to it such jobs do not exist.
  std::optional<Response> refuse_job(const Match& match, const Request& request) const;

  coordinator::Coordinator& coordinator_;
  TokenRegistry& tokens_;
  Auth auth_;
  Limits limits_;
  StaticFiles files_;
  Counters counters_;
  std::function<WebhookFigures()> webhooks_;
  std::stop_source stop_;
};

// Returns work(), or 503 (out of memory) or 500 if it throws. `what` names the work in the log.
Response guarded(std::string_view what, const std::function<Response()>& work);

// True if the id has the characters and length of ids made here; anything else is no job.
bool plausible_id(std::string_view id);

// The job in a request's address; with ?frame=N that frame of the sequence. not_found: it cannot be a job.
Result<JobId> job_of(const Request& request, const Params& params);

}  // namespace ls::http
