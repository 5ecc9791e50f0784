// Retries while a coordinator is unreachable for a while: a restart, a proxy in between, too many requests.
#pragma once

#include "common/base/clock.h"
#include "common/base/error.h"

namespace ls::cli {

class RetryPolicy {
 public:
  // True if the failed request should be retried; it has then waited, longer each time. False if the error is
  // permanent, or the coordinator has been unreachable for two minutes since the last answered().
  bool again(const Error& error);
  void answered();

 private:
  SystemClock clock_;
  TimePoint last_answer_ = clock_.now();
  int pause_milliseconds_ = 0;
};

// Runs `call`, which must be repeatable, until it succeeds or RetryPolicy gives up.
template <class Call>
auto with_retries(Call call) {
  RetryPolicy retry;
  auto answer = call();
  while (!answer && retry.again(answer.error().error)) answer = call();
  return answer;
}

}  // namespace ls::cli
