// A clock that blocks a coordinator's threads while it is shut, and so delays the verification of results.
#pragma once

#include <condition_variable>
#include <map>
#include <mutex>
#include <thread>

#include "core/base/clock.h"

namespace ls::coordinator {

// Advances only by advance(). While it is shut, now() returns only on the thread that made the clock.
class GateClock final : public Clock {
 public:
  TimePoint now() const override {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return !shut_ || std::this_thread::get_id() == maker_; });
    ++reads_[std::this_thread::get_id()];
    return at_;
  }
  void shut(bool is) {
    const std::lock_guard lock(mutex_);
    shut_ = is;
    changed_.notify_all();
  }
  void advance(Duration by) {
    const std::lock_guard lock(mutex_);
    at_ += by;
  }
  // Number of reads by threads other than the one that made the clock and the calling one
  int reads_of_others() const {
    const std::lock_guard lock(mutex_);
    int sum = 0;
    for (const auto& [thread, reads] : reads_)
      if (thread != maker_ && thread != std::this_thread::get_id()) sum += reads;
    return sum;
  }

 private:
  const std::thread::id maker_ = std::this_thread::get_id();
  mutable std::mutex mutex_;
  mutable std::condition_variable changed_;
  mutable std::map<std::thread::id, int> reads_;
  bool shut_ = false;
  TimePoint at_{std::chrono::hours(1)};
};

}  // namespace ls::coordinator
