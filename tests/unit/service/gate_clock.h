// A clock that holds the threads of a coordinator, and so its checks of results, while it is shut.
#pragma once

#include <condition_variable>
#include <map>
#include <mutex>
#include <thread>

#include "common/base/clock.h"

namespace ls::coordinator {

// Moves by hand. While it is shut nobody but its maker gets past now().
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
  // How often threads other than its maker and the calling one have read it
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
