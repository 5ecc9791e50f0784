// Decides whether to repeat a failed request: a coordinator may be unreachable for a while because of a
// restart, a proxy in between, or too many requests.
#pragma once

#include "common/base/clock.h"
#include "common/base/error.h"

namespace ls::cli {

class RetryPolicy {
 public:
  // Waits, each time longer, and returns true if the failed request should be repeated. Returns false without
  // waiting if `error` is permanent, or if the coordinator has been unreachable for two minutes since the
  // last answered().
  bool again(const Error& error);
  void answered();

 private:
  SystemClock clock_;
  TimePoint last_answer_ = clock_.now();
  int pause_milliseconds_ = 0;
};

// Runs `call`, which must be repeatable, until it succeeds or RetryPolicy::again() returns false.
template <class Call>
auto with_retries(Call call) {
  RetryPolicy retry;
  auto answer = call();
  while (!answer && retry.again(answer.error().error)) answer = call();
  return answer;
}

}  // namespace ls::cli
