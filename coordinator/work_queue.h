// Queues between the service's threads.
#pragma once

#include <condition_variable>
#include <cstddef>
#include <deque>
#include <functional>
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
    {
      const std::lock_guard lock(mutex_);
      items_.push_back(std::move(item));
    }
    filled_.notify_one();  // one item, one of those that wait: the others would find nothing
  }
  std::size_t size() const {
    const std::lock_guard lock(mutex_);
    return items_.size();
  }
  // Holds the caller back while more than `most` items wait. False: a stop was asked for.
  bool wait_for_room(std::size_t most, const std::stop_token& token) {
    std::unique_lock lock(mutex_);
    ++held_back_;
    const bool room = drained_.wait(lock, token, [&] { return items_.size() <= most; });
    --held_back_;
    return room && !token.stop_requested();
  }
  // Waits for at least one item; none: a stop was asked for.
  std::vector<T> pop(std::size_t most, const std::stop_token& token) {
    std::unique_lock lock(mutex_);
    std::vector<T> taken;
    if (!filled_.wait(lock, token, [&] { return !items_.empty(); }) || token.stop_requested()) return taken;
    while (!items_.empty() && taken.size() < most) {
      taken.push_back(std::move(items_.front()));
      items_.pop_front();
    }
    if (held_back_ > 0) drained_.notify_all();
    return taken;
  }

 private:
  mutable std::mutex mutex_;
  std::condition_variable_any filled_, drained_;
  std::deque<T> items_;
  int held_back_ = 0;  // in wait_for_room()
};

// Holds back who hands in more than there is room for.
class ByteBudget {
 public:
  explicit ByteBudget(std::size_t bytes) : room_(bytes) {}
  // False once closed. A single item larger than everything passes when nothing else is in.
  // `granted` is called once there is room, in the order of asking: at once on this thread, or later on one
  // that releases. Never after close(). Whoever waits must not be many: each of them is kept.
  void ask(std::size_t bytes, std::function<void()> granted) {
    {
      const std::lock_guard lock(mutex_);
      if (closed_) return;
      if (!waiting_.empty() || !fits(bytes)) {
        waiting_.push_back({bytes, std::move(granted)});
        return;
      }
      used_ += bytes;
    }
    granted();
  }
  void release(std::size_t bytes) {
    std::vector<std::function<void()>> granted;
    {
      const std::lock_guard lock(mutex_);
      used_ -= bytes;
      while (!closed_ && !waiting_.empty() && fits(waiting_.front().bytes)) {
        used_ += waiting_.front().bytes;
        granted.push_back(std::move(waiting_.front().granted));
        waiting_.pop_front();
      }
    }
    for (const auto& go_on : granted) go_on();
  }
  std::size_t used() const {
    const std::lock_guard lock(mutex_);
    return used_;
  }
  void close() {
    std::deque<Waiting> dropped;
    const std::lock_guard lock(mutex_);
    closed_ = true;
    dropped.swap(waiting_);
  }

 private:
  struct Waiting {
    std::size_t bytes;
    std::function<void()> granted;
  };
  bool fits(std::size_t bytes) const { return used_ == 0 || used_ + bytes <= room_; }

  mutable std::mutex mutex_;
  std::deque<Waiting> waiting_;
  std::size_t room_, used_ = 0;
  bool closed_ = false;
};

}  // namespace ls::coordinator
