// Queues between the service's threads, and periodic work on a thread.
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

#include "core/base/clock.h"

namespace ls::coordinator {

// FIFO queue. It is unbounded: callers limit it with a ByteBudget or wait_for_room().
template <class T>
class WorkQueue {
 public:
  void push(T item) {
    {
      const std::lock_guard lock(mutex_);
      items_.push_back(std::move(item));
    }
    filled_.notify_one();  // one is enough: a new item gives work to one thread only
  }
  std::size_t size() const {
    const std::lock_guard lock(mutex_);
    return items_.size();
  }
  // Blocks while more than `most` items are queued. False if a stop was requested.
  bool wait_for_room(std::size_t most, const std::stop_token& token) {
    std::unique_lock lock(mutex_);
    ++held_back_;
    const bool room = drained_.wait(lock, token, [&] { return items_.size() <= most; });
    --held_back_;
    return room && !token.stop_requested();
  }
  // Waits for at least one item and takes up to `most`. Empty if a stop was requested.
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
  int held_back_ = 0;  // threads blocked in wait_for_room()
};

// Limits how many bytes are in use at the same time. ask() requests bytes, and release() gives them back.
// Requests that exceed the limit wait in line.
class ByteBudget {
 public:
  explicit ByteBudget(std::size_t bytes) : room_(bytes) {}
  // Calls `granted` as soon as the bytes fit into the budget, in the order of requests: on this thread before
  // ask() returns if they fit now, else later on a thread that calls release(). `granted` is never called
  // after close(). A request larger than the whole budget is granted when nothing else is in use. The number
  // of waiting requests is unlimited, so callers must limit it.
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

// Calls act() repeatedly, each time after waiting for `pause`, until a stop is requested through `token`.
// Blocks the calling thread.
template <class Act>
void every(Duration pause, const std::stop_token& token, Act&& act) {
  std::mutex mutex;
  std::condition_variable_any woken;
  std::unique_lock lock(mutex);
  while (!woken.wait_for(lock, token, pause, [&] { return token.stop_requested(); }) &&
         !token.stop_requested())
    act();
}

}  // namespace ls::coordinator
