// A coordinator that is away for a while: a restart, a proxy in between, too many requests.
#pragma once

#include "common/base/clock.h"
#include "common/base/error.h"

namespace ls::cli {

class Patience {
 public:
  // Whether what failed so shall be tried again; has waited then, each time a little longer. False when the
  // error will not pass, or the coordinator has been away for two minutes since the last answered().
  bool again(const Error& error);
  void answered();

 private:
  SystemClock clock_;
  TimePoint last_answer_ = clock_.now();
  int pause_milliseconds_ = 0;
};

// Runs `call`, a request that may be made twice, until it succeeds or there is no sense in it.
template <class Call>
auto patiently(Call call) {
  Patience patience;
  auto answer = call();
  while (!answer && patience.again(answer.error().error)) answer = call();
  return answer;
}

}  // namespace ls::cli
