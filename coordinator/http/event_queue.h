// Between the coordinator, which tells events on any thread and must never wait, and one reader's connection.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <mutex>
#include <optional>
#include <string>

#include "coordinator/service.h"

namespace ls::http {

// One event as Server-Sent Events write it: id, event, data lines, an empty line.
std::string format_event(const coordinator::StreamEvent& event);

class EventQueue {
 public:
  struct Bounds {
    std::size_t events = 0;
    std::size_t bytes = 0;
  };
  // `job`: only events of this job and those of no one job. `after_id`: ids up to it are known to the reader;
  // when the first event told is later than the next id, the reader has missed some and gets a `reset` first.
  EventQueue(Bounds bounds, std::string job, std::uint64_t after_id, std::function<void()> wake);

  // Any thread, in the order of ids. Never waits; what doesn't fit ends the queue: see overflowed().
  void push(const coordinator::StreamEvent& event) { push(event, &event); }
  // `shown`: what the reader may see of it; null: nothing.
  void push(const coordinator::StreamEvent& event, const coordinator::StreamEvent* shown);

  // What is waiting, as text for the wire; empty if nothing.
  std::string take();
  // The reader was too slow: after take() has given what was queued, the connection ends. The reader comes
  // back with the last id it saw.
  bool overflowed() const;
  // No wake() after this returns.
  void close();

 private:
  const Bounds bounds_;
  const std::string job_;
  mutable std::mutex mutex_;
  std::optional<std::uint64_t> expected_;  // the next id; nothing once the first event has come
  std::function<void()> wake_;
  std::string text_;
  std::size_t events_ = 0;
  bool overflowed_ = false;
};

}  // namespace ls::http
