// A value that can be reached only while its mutex is held, so that the compiler enforces locking.
#pragma once

#include <condition_variable>
#include <mutex>
#include <utility>

#include "core/base/check.h"

namespace ls {

template <class T>
class Guarded {
 public:
  template <class... Args>
  explicit Guarded(Args&&... args) : value_(std::forward<Args>(args)...) {}

  // Gives access to the value. It holds the mutex from its construction to its destruction, except between
  // unlock() and lock().
  class Lock {
   public:
    T& operator*() const {
      CHECK(lock_.owns_lock());
      return value_;
    }
    T* operator->() const { return &**this; }
    void unlock() { lock_.unlock(); }
    void lock() { lock_.lock(); }
    // Waits until `done` returns true: calls it at once, and again whenever `changed` is notified. The mutex
    // is held during these calls, not while waiting.
    template <class Done>
    void wait(std::condition_variable& changed, Done&& done) {
      changed.wait(lock_, std::forward<Done>(done));
    }

   private:
    friend class Guarded;
    Lock(std::mutex& mutex, T& value) : lock_(mutex), value_(value) {}
    std::unique_lock<std::mutex> lock_;
    T& value_;
  };
  Lock lock() { return {mutex_, value_}; }

 private:
  std::mutex mutex_;
  T value_;
};

}  // namespace ls
