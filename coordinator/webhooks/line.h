// The delivery queue of one receiver with its retry schedule: a function of the deliveries added, the
// outcomes and the time.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <string>

#include "common/base/clock.h"

namespace ls::coordinator::webhooks {

inline constexpr int kMaxAttempts = 20;  // then the delivery is dropped: after about an hour and a half
inline constexpr std::size_t kMaxWaiting = 10000;  // then the oldest delivery is dropped
inline constexpr double kFirstRetrySeconds = 1, kMaxRetrySeconds = 300;

struct Delivery {
  std::uint64_t number = 0;  // ascending in the order of events; its name on disk
  std::string id;            // lets receivers detect repeated deliveries
  std::string event;         // "job.done"
  std::string body;          // JSON
};

// One receiver's deliveries, in order: while the first is not accepted the others wait, so that "done" never
// arrives before "running". Not thread-safe.
class Line {
 public:
  // Returns the delivery that was dropped because too many wait, else nullopt.
  std::optional<Delivery> add(Delivery delivery);
  // The delivery to send now; null if there is none or its time has not come.
  const Delivery* due(TimePoint now) const;
  // When due() will return one; nullopt: none waits.
  std::optional<TimePoint> next_due() const;
  // Reports the outcome of sending due(). Returns the delivery if it is finished: accepted, or dropped.
  std::optional<Delivery> taken();
  std::optional<Delivery> failed(TimePoint now);
  std::size_t waiting() const { return waiting_.size(); }
  int attempts() const { return attempts_; }  // at the first delivery, so far

 private:
  Delivery pop();
  std::deque<Delivery> waiting_;
  int attempts_ = 0;
  TimePoint not_before_{};
};

double retry_seconds(int attempts);  // seconds to wait after this many attempts

}  // namespace ls::coordinator::webhooks
