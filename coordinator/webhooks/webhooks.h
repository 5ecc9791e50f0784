// Notifies receivers of changes to jobs: a signed POST for every change of a job's state, repeated until it
// is accepted, and delivered at least once even if processes are killed. Only the operator names receivers
// (--webhook): no job, scene or user can.
//
//   POST URL
//   Content-Type: application/json
//   Lightshaft-Event: job.done               job.STATE, as in GET /api/v1/jobs/ID; or job.removed, or
//                                            job.moved (another coordinator continues it and sends
//                                            later events)
//   Lightshaft-Delivery: j-1f/done/4711      the same when it is sent again
//   Lightshaft-Signature: t=UNIX,v1=HEX      HEX = HMAC-SHA-256(secret, "UNIX." + body),
//                                            UNIX = time of sending
//   traceparent: 00-...                      only of a traced job: the span of this delivery
//   {"event": "job.done", "id": "j-1f/done/4711", "job": {as in the API}}
//
// A receiver accepts a notification by a 2xx answer. After any other answer, or none within 15 s, the
// notification is sent again, after pauses of 1, 2, 4 ... 300 s, until 20 attempts have failed; later
// notifications to that receiver wait meanwhile. If a job's state changes twice in quick succession, only the
// second state may be reported.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "common/base/clock.h"
#include "common/base/error.h"
#include "common/http/post.h"
#include "common/trace/tracer.h"
#include "coordinator/service/coordinator.h"

namespace ls::coordinator {

class Webhooks {
 public:
  struct Options {
    std::vector<std::string> urls;
    std::string secret;
    std::filesystem::path folder;  // folder of pending notifications
    std::shared_ptr<const Clock> clock;
    std::function<double()> unix_time;  // seconds since 1970
    // Sends the request; ls::post by default
    std::function<Result<HttpAnswer>(const HttpPost&)> send = {};
    // Records a span for each attempt to deliver a notification of a traced job; null: none
    std::shared_ptr<trace::Tracer> tracer = nullptr;
  };
  // Starts the sending threads. Destroying the returned object stops them; the coordinator must outlive it.
  static Result<std::unique_ptr<Webhooks>> start(Coordinator& coordinator, Options options);
  ~Webhooks();
  WebhookFigures figures() const;

 private:
  class Impl;
  explicit Webhooks(std::unique_ptr<Impl> impl);
  const std::unique_ptr<Impl> impl_;
};

// Returns the value of the header Lightshaft-Signature.
std::string webhook_signature(const std::string& secret, std::int64_t unix_seconds, const std::string& body);

}  // namespace ls::coordinator
