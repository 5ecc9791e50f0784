// The queue of events for one reader of an event stream. The coordinator pushes events on any thread and must
// never block; the reader's connection takes their text and sends it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <mutex>
#include <optional>
#include <string>

#include "coordinator/views/views.h"

namespace ls::http {

// Formats an event for Server-Sent Events: id, event, data lines, an empty line.
std::string format_event(const coordinator::StreamEvent& event);

class EventQueue {
 public:
  struct Bounds {
    std::size_t events = 0;
    std::size_t bytes = 0;
  };
  // If `job` is set, the reader gets only the events of this job (and of its frames) and those that belong to
  // no single job; if it is empty, all events. `after_id` is the id of the last event that the reader has
  // received. If the first event pushed has an id above `after_id` + 1, the reader has missed events and
  // first gets an event `reset`. `wake` is called when the queue is no longer empty.
  EventQueue(Bounds bounds, std::string job, std::uint64_t after_id, std::function<void()> wake);

  // Adds an event; may be called on any thread, in the order of the events' ids. It never blocks. An event
  // that exceeds the bounds is dropped, and overflowed() is true from then on.
  void push(const coordinator::StreamEvent& event) { push(event, &event); }
  // Adds `shown`, the part of `event` that the reader may see. Null: the reader may not see the event at all.
  void push(const coordinator::StreamEvent& event, const coordinator::StreamEvent* shown);

  // Removes the text of all waiting events from the queue and returns it for sending; empty if there is none.
  std::string take();
  // True if the reader was too slow and an event had to be dropped. The connection then sends the result of
  // take() and ends; the reader connects again with the id of the last event that it got.
  bool overflowed() const;
  // After close() has returned, `wake` is not called any more.
  void close();

 private:
  const Bounds bounds_;
  const std::string job_;
  mutable std::mutex mutex_;
  // Id that the first event has if the reader has missed none; nullopt after the first event.
  std::optional<std::uint64_t> expected_;
  std::function<void()> wake_;
  std::string text_;
  std::size_t events_ = 0;
  bool overflowed_ = false;
};

}  // namespace ls::http
