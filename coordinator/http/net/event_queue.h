// Queue between the coordinator, which publishes events on any thread and must never block, and one reader's
// connection.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <mutex>
#include <optional>
#include <string>

#include "coordinator/views/job_view.h"

namespace ls::http {

// Formats an event for Server-Sent Events: id, event, data lines, an empty line.
std::string format_event(const coordinator::StreamEvent& event);

class EventQueue {
 public:
  struct Bounds {
    std::size_t events = 0;
    std::size_t bytes = 0;
  };
  // `job`: only events of this job and those of no single job; empty: all. `after_id`: the last id that the
  // reader knows; if the first event pushed does not have the next id, the reader has missed some and gets a
  // `reset` first.
  EventQueue(Bounds bounds, std::string job, std::uint64_t after_id, std::function<void()> wake);

  // Called on any thread, in the order of ids. Never blocks; an event that does not fit ends the queue: see
  // overflowed().
  void push(const coordinator::StreamEvent& event) { push(event, &event); }
  // `shown`: the event as the reader may see it; null: not at all.
  void push(const coordinator::StreamEvent& event, const coordinator::StreamEvent* shown);

  // Takes the waiting text for the wire; empty if there is none.
  std::string take();
  // True if the reader was too slow: after the last take() the connection ends. The reader reconnects with
  // the last id it saw.
  bool overflowed() const;
  // No wake() is called after this returns.
  void close();

 private:
  const Bounds bounds_;
  const std::string job_;
  mutable std::mutex mutex_;
  std::optional<std::uint64_t> expected_;  // the next id; nullopt after the first event
  std::function<void()> wake_;
  std::string text_;
  std::size_t events_ = 0;
  bool overflowed_ = false;
};

}  // namespace ls::http
