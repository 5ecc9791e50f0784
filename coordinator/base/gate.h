// Turns (turns.h) for threads: a thread waits until its caller's request is served.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <string>

#include "coordinator/base/turns.h"

namespace ls::coordinator {

// Thread-safe.
class Gate {
 public:
  explicit Gate(Turns::Bounds bounds) : turns_(bounds) {}

  // Blocks until it is the turn of `caller`'s request, which needs `bytes` of memory.
  class Place {
   public:
    Place(Gate& gate, const std::string& caller, std::uint64_t bytes) : gate_(gate) {
      std::unique_lock lock(gate_.mutex_);
      bool served = false;
      ticket_ = gate_.turns_.ask(caller, bytes, [&served] { served = true; });
      gate_.served_.wait(lock, [&served] { return served; });
    }
    ~Place() {
      const std::lock_guard lock(gate_.mutex_);
      gate_.turns_.leave(ticket_);
      gate_.served_.notify_all();
    }
    Place(const Place&) = delete;
    Place& operator=(const Place&) = delete;

   private:
    Gate& gate_;
    Turns::Ticket ticket_ = 0;
  };

 private:
  std::mutex mutex_;
  std::condition_variable served_;
  Turns turns_;
};

}  // namespace ls::coordinator
