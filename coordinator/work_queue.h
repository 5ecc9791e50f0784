// Queues between the service's threads.
#pragma once

#include <condition_variable>
#include <cstddef>
#include <deque>
#include <mutex>
#include <optional>
#include <stop_token>
#include <utility>
#include <vector>

namespace ls::coordinator {

// Unbounded by itself: what goes in is bounded by a ByteBudget or by its nature.
template <class T>
class WorkQueue {
 public:
  void push(T item) {
    const std::lock_guard lock(mutex_);
    items_.push_back(std::move(item));
    changed_.notify_one();
  }
  // Waits for at least one item; none: a stop was asked for.
  std::vector<T> pop(std::size_t most, const std::stop_token& token) {
    std::unique_lock lock(mutex_);
    std::vector<T> taken;
    if (!changed_.wait(lock, token, [&] { return !items_.empty(); }) || token.stop_requested()) return taken;
    while (!items_.empty() && taken.size() < most) {
      taken.push_back(std::move(items_.front()));
      items_.pop_front();
    }
    return taken;
  }

 private:
  std::mutex mutex_;
  std::condition_variable_any changed_;
  std::deque<T> items_;
};

// Holds back who hands in more than there is room for.
class ByteBudget {
 public:
  explicit ByteBudget(std::size_t bytes) : room_(bytes) {}
  // False once closed. A single item larger than everything passes when nothing else is in.
  bool acquire(std::size_t bytes) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return closed_ || used_ == 0 || used_ + bytes <= room_; });
    if (closed_) return false;
    used_ += bytes;
    return true;
  }
  void release(std::size_t bytes) {
    const std::lock_guard lock(mutex_);
    used_ -= bytes;
    changed_.notify_all();
  }
  void close() {
    const std::lock_guard lock(mutex_);
    closed_ = true;
    changed_.notify_all();
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  std::size_t room_, used_ = 0;
  bool closed_ = false;
};

}  // namespace ls::coordinator
