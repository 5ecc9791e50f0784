// What waits for one receiver, and when to try it: a function of what was added, what came of it, and the
// time.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <string>

#include "common/base/clock.h"

namespace ls::coordinator::webhooks {

inline constexpr int kMaxAttempts = 20;            // then it is given up: about an hour and a half
inline constexpr std::size_t kMaxWaiting = 10000;  // then the oldest is given up
inline constexpr double kFirstRetrySeconds = 1, kMaxRetrySeconds = 300;

struct Delivery {
  std::uint64_t number = 0;  // ascending in the order of happening; names it on disk
  std::string id;            // tells a second sending of it from another event
  std::string event;         // "job.done"
  std::string body;          // JSON
};

// One receiver's deliveries, in order: while the first is not taken the others wait, so that "done" never
// comes before "running". Not thread-safe.
class Line {
 public:
  // What had to be given up for it, if too many wait.
  std::optional<Delivery> add(Delivery delivery);
  // The one to send, if its time has come.
  const Delivery* due(TimePoint now) const;
  // When due() will have one; nothing: none waits.
  std::optional<TimePoint> next_due() const;
  // What came of sending due(). The delivery is returned when it is over: taken, or given up.
  std::optional<Delivery> taken();
  std::optional<Delivery> failed(TimePoint now);
  std::size_t waiting() const { return waiting_.size(); }
  int attempts() const { return attempts_; }  // of the first one, so far

 private:
  Delivery pop();
  std::deque<Delivery> waiting_;
  int attempts_ = 0;
  TimePoint not_before_{};
};

double retry_seconds(int attempts);  // to wait after so many

}  // namespace ls::coordinator::webhooks
