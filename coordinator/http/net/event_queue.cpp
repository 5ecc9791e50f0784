#include "coordinator/http/net/event_queue.h"

#include <fmt/format.h>

#include <utility>

namespace ls::http {

std::string format_event(const coordinator::StreamEvent& event) {
  std::string text = fmt::format("id: {}\nevent: {}\n", event.id, event.type);
  std::string_view rest = event.data;
  while (true) {
    const std::size_t end = rest.find_first_of("\r\n");
    text += fmt::format("data: {}\n", rest.substr(0, end));
    if (end == std::string_view::npos) break;
    rest.remove_prefix(rest.substr(end).starts_with("\r\n") ? end + 2 : end + 1);
  }
  text += '\n';
  return text;
}

namespace {
bool is_frame(const std::string& job, const std::string& sequence) {
  if (!job.starts_with(sequence)) return false;
  const auto frame = coordinator::frame_of(JobId{job});
  return frame && frame->sequence.value == sequence;
}
}  // namespace

EventQueue::EventQueue(Bounds bounds, std::string job, std::uint64_t after_id, std::function<void()> wake)
    : bounds_(bounds), job_(std::move(job)), expected_(after_id + 1), wake_(std::move(wake)) {}

void EventQueue::push(const coordinator::StreamEvent& event, const coordinator::StreamEvent* shown) {
  const std::lock_guard lock(mutex_);
  if (overflowed_ || !wake_) return;
  std::string text;
  if (const auto expected = std::exchange(expected_, std::nullopt); expected && event.id > *expected)
    text = fmt::format("event: reset\ndata: {{\"missed_from\":{},\"missed_to\":{}}}\n\n", *expected,
                       event.id - 1);
  const bool wanted = job_.empty() || event.job.empty() || event.job == job_ || is_frame(event.job, job_);
  if (wanted && shown != nullptr) text += format_event(*shown);
  if (text.empty()) return;
  const bool first = text_.empty();
  if (events_ == bounds_.events || text_.size() + text.size() > bounds_.bytes) {
    overflowed_ = true;
  } else {
    text_ += text;
    ++events_;
  }
  // Only an event that arrives in an empty queue wakes the reader, because a reader that is awake checks for
  // more events before it waits again.
  if (first) wake_();
}

std::string EventQueue::take() {
  const std::lock_guard lock(mutex_);
  events_ = 0;
  return std::exchange(text_, {});
}

bool EventQueue::overflowed() const {
  const std::lock_guard lock(mutex_);
  return overflowed_;
}

void EventQueue::close() {
  const std::lock_guard lock(mutex_);
  wake_ = nullptr;
}

}  // namespace ls::http
