// Notifies receivers of changes to jobs: each change of a job's state is sent as a signed POST to every
// receiver. A notification is sent again until the receiver accepts it or 20 attempts have failed.
// Notifications are stored on disk, so they survive if the coordinator is killed; a notification may then
// arrive twice. Only the operator names receivers (--webhook): no job, scene or user can.
//
//   POST URL
//   Content-Type: application/json
//   Lightshaft-Event: job.done               job.STATE, with STATE as in GET /api/v1/jobs/ID; or job.removed,
//                                            or job.moved (another coordinator continues the job and sends
//                                            its later notifications)
//   Lightshaft-Delivery: j-1f/done/4711      the id of the notification, the same in all attempts
//   Lightshaft-Signature: t=UNIX,v1=HEX      UNIX = time of sending, in seconds since 1970,
//                                            HEX = HMAC-SHA-256(secret, "UNIX." + body)
//   traceparent: 00-...                      only if the job is traced: the span of this attempt
//   {"event": "job.done", "id": "j-1f/done/4711", "job": {as in the API}}
//
// A receiver accepts a notification by a 2xx answer. After any other answer, or none within 15 s, the
// notification is sent again after a pause: 1 s after the first failed attempt, then 2, 4 ... up to 300 s.
// Meanwhile later notifications to this receiver wait. If a job's state changes twice in quick succession, it
// may happen that only the second state is reported.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "coordinator/service/coordinator.h"
#include "core/base/clock.h"
#include "core/base/error.h"
#include "util/http/post.h"
#include "util/trace/tracer.h"

namespace ls::coordinator {

class Webhooks {
 public:
  struct Options {
    std::vector<std::string> urls;
    std::string secret;
    std::filesystem::path folder;  // where pending notifications are stored (DIR in webhook_outbox.h)
    std::shared_ptr<const Clock> clock;
    std::function<double()> unix_time;  // returns the time in seconds since 1970
    // Sends a request and returns the answer; if empty, ls::post() is used.
    std::function<Result<HttpAnswer>(const HttpPost&)> send = {};
    // Records a span for each attempt to deliver a notification of a traced job; null: no spans are recorded.
    std::shared_ptr<trace::Tracer> tracer = nullptr;
  };
  // Subscribes to the changes of jobs and starts a sending thread for each receiver. Destroying the returned
  // object stops both. The coordinator must outlive it.
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
