// Api turns requests into responses, without sockets: routing, authentication, limits and handlers. The
// server loop (net/http_server.h) calls admit() when a request's header has arrived. Then it reads the body
// and calls handle(), or it passes a streamed body piece by piece to the sink from open_upload().
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <stop_token>
#include <variant>

#include "coordinator/base/gate.h"
#include "coordinator/http/api/announced_jobs.h"
#include "coordinator/http/api/metrics.h"
#include "coordinator/http/api/partial_uploads.h"
#include "coordinator/http/api/routes.h"
#include "coordinator/http/api/static_files.h"
#include "coordinator/http/auth/auth.h"
#include "coordinator/http/bundle/stage.h"
#include "coordinator/http/message/limits.h"
#include "coordinator/http/message/message.h"
#include "coordinator/service/coordinator.h"

namespace ls::http {

// Receives the body of one request in pieces, as they arrive. If the sink is destroyed before finish(), the
// received bytes are dropped, except in an upload in parts, which a later request can continue.
class BodySink {
 public:
  virtual ~BodySink() = default;
  // Takes the next bytes of the body. Returns a response if the body is rejected: the caller then stops
  // reading and sends that response.
  virtual std::optional<Response> append(std::span<const std::byte> bytes) = 0;
  virtual Response finish() = 0;
};

// How workers join this farm.
struct Joining {
  std::string address;  // HOST:PORT of the workers' port: as the coordinator listens, or as the operator says
  bool tls = false;     // workers need the certificate of the authority, too
  std::string token_file;  // the file with the join token, on the coordinator's machine
};

class Api {
 public:
  // `tokens` must outlive the object. `secure`: requests arrive over TLS.
  Api(coordinator::Coordinator& coordinator, TokenRegistry& tokens, Limits limits, StaticFiles files,
      bool secure = false);

  // Decides from the header alone how the request is handled, and sets request.caller. Returns the matching
  // route, or a Response that the server sends without calling handle(): a static file, or an error (unknown
  // address, missing or insufficient token, too many requests, body too long).
  std::variant<Response, Match> admit(Request& request);
  // Returns the greatest allowed length of this request's body in bytes. The limit also applies to a body
  // without Content-Length.
  std::uint64_t body_limit(const Route& route, const Request& request) const;
  // Returns how this request's body is to be read: BodyKind::archive if its media type is in Route::unpacks,
  // else Route::body.
  BodyKind body_kind(const Route& route, const Request& request) const;
  // Runs the route's handler; never throws. Waits while the caller has so many large images in work that this
  // one would exceed its share of Limits::picture_memory.
  Response handle(const Match& match, const Request& request);
  // True if `response` is a 404 for a job that another coordinator may have. The caller should then call
  // ask_other_coordinator(), which finds the job's coordinator and may block for a second. It returns a
  // redirect to that coordinator, 503 if that coordinator does not answer, or `response` unchanged if no
  // coordinator has the job.
  bool may_be_another_coordinators(const Match& match, const Response& response) const;
  Response ask_other_coordinator(const Match& match, const Request& request, Response response);
  // Returns the sink for a body that is streamed (BodyKind::blob and archive), or the response that rejects
  // the request.
  std::variant<Response, std::unique_ptr<BodySink>> open_upload(const Match& match, const Request& request);
  // Asks long-running work to end at its next step; called when the coordinator stops.
  void ask_to_stop() { stop_.request_stop(); }
  std::stop_token stop_token() const { return stop_.get_token(); }

  coordinator::Coordinator& coordinator() { return coordinator_; }
  Auth& auth() { return auth_; }
  TokenRegistry& tokens() { return tokens_; }
  Counters& counters() { return counters_; }
  const Limits& limits() const { return limits_; }
  PartialUploads& partial_uploads() { return partial_uploads_; }
  AnnouncedJobs& announced() { return announced_; }
  // Sets the function from which /metrics gets the webhook counters; call this before the first request. If
  // it is never called, /metrics has no webhook counters.
  void webhooks(std::function<coordinator::WebhookFigures()> figures) { webhooks_ = std::move(figures); }
  // Sets the function that says what is wrong with the workers' port (empty: nothing); /readyz asks it
  void workers_port(std::function<std::string()> trouble) { workers_port_ = std::move(trouble); }
  // Sets what reads stages of USD; without it they are refused. Call this before the first request
  void stages(std::unique_ptr<StageReader> reader) { stages_ = std::move(reader); }
  StageReader* stages() const { return stages_.get(); }
  // Sets how workers join, which the dashboard tells those who add one
  void joining(Joining joining) { joining_ = std::move(joining); }
  const Joining& joining() const { return joining_; }
  std::string workers_port_trouble() const { return workers_port_ ? workers_port_() : std::string(); }
  // Sets the function from which /metrics gets the counters of trace spans; call this before the first
  // request
  void traces(std::function<trace::Figures()> figures) { traces_ = std::move(figures); }
  std::optional<trace::Figures> traces() const { return traces_ ? std::optional(traces_()) : std::nullopt; }
  std::optional<coordinator::WebhookFigures> webhooks() const {
    return webhooks_ ? std::optional(webhooks_()) : std::nullopt;
  }

 private:
  std::variant<Response, Match> admit_route(Request& request);
  std::optional<Response> refuse_caller(Access access, Request& request);
  std::optional<Response> refuse_body(const Route& route, const Request& request) const;
  // Returns a 404 if a submit token is used for another user's job, which is invisible to this caller.
  std::optional<Response> refuse_job(const Match& match, const Request& request) const;

  coordinator::Coordinator& coordinator_;
  TokenRegistry& tokens_;
  Auth auth_;
  Limits limits_;
  StaticFiles files_;
  Joining joining_;
  std::unique_ptr<StageReader> stages_;
  Counters counters_;
  PartialUploads partial_uploads_{coordinator::limits::kMaxUnfinishedUploads / 4};
  AnnouncedJobs announced_;
  coordinator::Gate pictures_;  // callers take turns to have answers about images made
  std::function<coordinator::WebhookFigures()> webhooks_;
  std::function<trace::Figures()> traces_;
  std::function<std::string()> workers_port_;
  std::stop_source stop_;
};

// Returns work(). If it throws, returns 503 (out of memory) or 500 (anything else). `what` names the work in
// the log.
Response guarded(std::string_view what, const std::function<Response()>& work);

// True if the text has the form of the ids that coordinators make (1 to limits::kIdBytes letters, digits,
// '-' and '_'). Any other text is no job's id.
bool plausible_id(std::string_view id);

// Returns the id of the job in a request's address. With ?frame=N the address names a sequence (a job with
// several frames), and the id is that of its frame N. not_found: the text cannot be the id of a job.
Result<JobId> job_of(const Request& request, const Params& params);

}  // namespace ls::http
