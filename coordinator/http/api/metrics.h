// /metrics in Prometheus' text format
#pragma once

#include <atomic>
#include <cstdint>
#include <map>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <utility>

#include "coordinator/http/message/message.h"
#include "coordinator/service/coordinator.h"

namespace ls::http {

// Counters that the HTTP server loop increments and /metrics shows. Thread-safe.
class Counters {
 public:
  void answered(Method method, int status);
  std::map<std::pair<Method, int>, std::uint64_t> requests() const;

  std::atomic<std::uint64_t> connections{0};     // open now
  std::atomic<std::uint64_t> event_streams{0};   // open now
  std::atomic<std::uint64_t> events_dropped{0};  // readers disconnected because they were too slow
  std::atomic<std::uint64_t> body_bytes{0};      // received

 private:
  mutable std::mutex mutex_;
  std::map<std::pair<Method, int>, std::uint64_t> requests_;
};

// Numbers of notifications to webhooks (coordinator/webhooks) since the start: accepted by a receiver,
// attempts that failed, notifications given up; and those that wait to be sent now.
struct WebhookFigures {
  std::uint64_t delivered = 0, failed_attempts = 0, given_up = 0, waiting = 0;
};

// Returns the text of /metrics. Without `webhooks` it has no webhook counters.
std::string metrics_text(std::span<const coordinator::JobView> jobs,
                         std::span<const coordinator::WorkerView> workers, std::uint64_t last_event,
                         const Counters& counters, const coordinator::StoreStatus& store = {},
                         const coordinator::FarmFigures& farm = {},
                         const coordinator::AuditFigures& audits = {},
                         const std::optional<WebhookFigures>& webhooks = std::nullopt);

}  // namespace ls::http
