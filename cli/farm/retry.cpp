#include "cli/farm/retry.h"

#include <poll.h>

#include <algorithm>

namespace ls::cli {
namespace {
constexpr double kRemoteSeconds = 120;
constexpr int kFirstPauseMilliseconds = 250, kLongestPauseMilliseconds = 4000;
}  // namespace

bool RetryPolicy::again(const Error& error) {
  if (error.code != Errc::unavailable || seconds(clock_.now() - last_answer_) > kRemoteSeconds) return false;
  pause_milliseconds_ =
      std::clamp(2 * pause_milliseconds_, kFirstPauseMilliseconds, kLongestPauseMilliseconds);
  ::poll(nullptr, 0, pause_milliseconds_);
  return true;
}

void RetryPolicy::answered() {
  last_answer_ = clock_.now();
  pause_milliseconds_ = 0;
}

}  // namespace ls::cli
