// From a request to a response, without sockets: routing, authentication, limits, handlers. The server loop
// (server.h) calls admit() when a header has arrived, then handle() with the whole body, or open_upload() and
// its sink.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <stop_token>
#include <variant>

#include "coordinator/http/auth.h"
#include "coordinator/http/limits.h"
#include "coordinator/http/message.h"
#include "coordinator/http/metrics.h"
#include "coordinator/http/routes.h"
#include "coordinator/http/static_files.h"
#include "coordinator/service.h"

namespace ls::http {

// Where a streamed body goes. Destroyed before finish(): nothing of it stays.
class BodySink {
 public:
  virtual ~BodySink() = default;
  virtual std::optional<Response> append(
      std::span<const std::byte> bytes) = 0;  // a response: give up, answer this
  virtual Response finish() = 0;
};

class Api {
 public:
  // `tokens` outlives this. `secure`: what comes here came over TLS.
  Api(coordinator::Coordinator& coordinator, TokenBook& tokens, Limits limits, StaticFiles files,
      bool secure = false);

  // A match to go on with, or the answer already: an unknown address, no token or one that may not, too many
  // requests, too long a body, a static file. Sets request.caller.
  std::variant<Response, Match> admit(Request& request);
  // Bytes that this request's body may have, announced or not.
  std::uint64_t body_limit(const Route& route, const Request& request) const;
  // What becomes of this request's body: the route's kind, or `archive` if it is of a type that the route
  // unpacks.
  BodyKind body_kind(const Route& route, const Request& request) const;
  // Runs the route's handler; no exception leaves it.
  Response handle(const Match& match, const Request& request);
  // Whether a 404 may be because another coordinator has the job. Then ask_elsewhere(), which may wait for a
  // second, says so, or gives the answer back as it was.
  bool may_be_elsewhere(const Match& match, const Response& response) const;
  Response ask_elsewhere(const Match& match, const Request& request, Response response);
  // For bodies that are streamed: BodyKind::blob and archive.
  std::variant<Response, std::unique_ptr<BodySink>> open_upload(const Match& match, const Request& request);
  // Long work ends at its next step: the coordinator stops.
  void ask_to_stop() { stop_.request_stop(); }
  std::stop_token stop_token() const { return stop_.get_token(); }

  coordinator::Coordinator& coordinator() { return coordinator_; }
  Auth& auth() { return auth_; }
  TokenBook& tokens() { return tokens_; }
  Counters& counters() { return counters_; }
  const Limits& limits() const { return limits_; }
  // Asked at every look at /metrics; before the first request. Without it there are no webhooks.
  void webhooks(std::function<WebhookFigures()> figures) { webhooks_ = std::move(figures); }
  std::optional<WebhookFigures> webhooks() const {
    return webhooks_ ? std::optional(webhooks_()) : std::nullopt;
  }

 private:
  std::variant<Response, Match> admit_route(Request& request);
  std::optional<Response> refuse_caller(Access access, Request& request);
  std::optional<Response> refuse_body(const Route& route, const Request& request) const;
  // To a submit token every job of others is as if it were not.
  std::optional<Response> refuse_job(const Match& match, const Request& request) const;

  coordinator::Coordinator& coordinator_;
  TokenBook& tokens_;
  Auth auth_;
  Limits limits_;
  StaticFiles files_;
  Counters counters_;
  std::function<WebhookFigures()> webhooks_;
  std::stop_source stop_;
};

// What `work` answers; of an exception a 503 (no memory) or 500, so that none leaves. `what` names it in the
// log.
Response guarded(std::string_view what, const std::function<Response()>& work);

// Characters and length of an id that we could have made; anything else is no job.
bool plausible_id(std::string_view id);

// The job in a request's address; with ?frame=N that frame of the sequence. not_found: it can't be one.
Result<JobId> job_of(const Request& request, const Params& params);

}  // namespace ls::http
