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
  Api(coordinator::Coordinator& coordinator, std::string token, Limits limits, StaticFiles files);

  // A match to go on with, or the answer already: an unknown address, no token, too long a body, a static
  // file.
  std::variant<Response, Match> admit(const Request& request) const;
  // Bytes that this request's body may have, announced or not.
  std::uint64_t body_limit(const Route& route, const Request& request) const;
  // What becomes of this request's body: the route's kind, or `archive` if it is of a type that the route
  // unpacks.
  BodyKind body_kind(const Route& route, const Request& request) const;
  // Runs the route's handler; no exception leaves it.
  Response handle(const Match& match, const Request& request);
  // For bodies that are streamed: BodyKind::blob and archive.
  std::variant<Response, std::unique_ptr<BodySink>> open_upload(const Match& match, const Request& request);
  // Long work ends at its next step: the coordinator stops.
  void ask_to_stop() { stop_.request_stop(); }
  std::stop_token stop_token() const { return stop_.get_token(); }

  coordinator::Coordinator& coordinator() { return coordinator_; }
  Auth& auth() { return auth_; }
  Counters& counters() { return counters_; }
  const Limits& limits() const { return limits_; }

 private:
  std::optional<Response> refuse_body(const Route& route, const Request& request) const;

  coordinator::Coordinator& coordinator_;
  Auth auth_;
  Limits limits_;
  StaticFiles files_;
  Counters counters_;
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
