// The queue of deliveries (notifications that wait to be sent) to one receiver, and the times of its retries.
// They depend on nothing but the deliveries added, the outcomes reported and the times passed in.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <string>

#include "common/base/clock.h"

namespace ls::coordinator::webhooks {

// A delivery is dropped after this many failed attempts, about an hour after the first
inline constexpr int kMaxAttempts = 20;
inline constexpr std::size_t kMaxWaiting = 10000;  // when more deliveries wait, the oldest is dropped
inline constexpr double kFirstRetrySeconds = 1, kMaxRetrySeconds = 300;

struct Delivery {
  std::uint64_t number = 0;  // ascending in the order of events; the delivery's file is named after it
  std::string id;            // lets receivers detect repeated deliveries
  std::string event;         // "job.done"
  std::string body;          // JSON
};

// One receiver's deliveries, in order. The others wait until the first is accepted or dropped, so that "done"
// never arrives before "running". Not thread-safe.
class Line {
 public:
  // Returns the delivery that was dropped because too many wait, else nullopt.
  std::optional<Delivery> add(Delivery delivery);
  // Returns the delivery to send now; null if none waits or the time for its next attempt has not come.
  const Delivery* due(TimePoint now) const;
  // Returns the time from which due() will return a delivery; nullopt: none waits.
  std::optional<TimePoint> next_due() const;
  // Report whether the receiver has accepted the delivery that due() returned. Both return the delivery if
  // the line is finished with it: taken() always, failed() if it is dropped after kMaxAttempts attempts.
  std::optional<Delivery> taken();
  std::optional<Delivery> failed(TimePoint now);
  std::size_t waiting() const { return waiting_.size(); }
  int attempts() const { return attempts_; }  // failed attempts so far to send the first delivery

 private:
  Delivery pop();
  std::deque<Delivery> waiting_;
  int attempts_ = 0;
  TimePoint not_before_{};
};

double retry_seconds(int attempts);  // seconds to wait after this many attempts

}  // namespace ls::coordinator::webhooks
