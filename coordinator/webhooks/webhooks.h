// Tells receivers what becomes of jobs: a POST for every change of a job's state, signed, repeated until it
// is taken, at least once whatever is killed. Only the operator names receivers (--webhook): no job, scene or
// user can.
//
//   POST URL
//   Content-Type: application/json
//   Lightshaft-Event: job.done                         job.STATE, as in GET /api/v1/jobs/ID; job.removed;
//   job.moved:
//                                                      another coordinator goes on with it, and tells the
//                                                      rest
//   Lightshaft-Delivery: j-1f/done/4711                the same when it is sent again
//   Lightshaft-Signature: t=UNIX,v1=HEX                HEX = HMAC-SHA-256(secret, "UNIX." + body), UNIX =
//   time of sending
//   {"event": "job.done", "id": "j-1f/done/4711", "job": {as the API shows it}}
//
// An answer of 2xx takes it. Anything else, and no answer within 15 s, is tried again after 1, 2, 4 ... 300
// s, 20 times; what comes later waits meanwhile. A change that is undone within the same instant may be told
// by its outcome alone.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "common/base/clock.h"
#include "common/base/error.h"
#include "coordinator/service.h"
#include "coordinator/webhooks/post.h"

namespace ls::coordinator {

class Webhooks {
 public:
  struct Options {
    std::vector<std::string> urls;
    std::string secret;
    std::filesystem::path folder;  // of what must still be told
    std::shared_ptr<const Clock> clock;
    std::function<double()> unix_time;                            // wall clock, seconds
    std::function<Result<int>(const webhooks::Post&)> send = {};  // webhooks::send unless told otherwise
  };
  struct Figures {
    std::uint64_t delivered = 0, failed_attempts = 0, given_up = 0, waiting = 0;
  };
  // Ends, sending nothing more, when it is destroyed; the coordinator must live longer.
  static Result<std::unique_ptr<Webhooks>> start(Coordinator& coordinator, Options options);
  virtual ~Webhooks() = default;
  virtual Figures figures() const = 0;
};

// The value of Lightshaft-Signature.
std::string webhook_signature(const std::string& secret, std::int64_t unix_seconds, const std::string& body);

}  // namespace ls::coordinator
