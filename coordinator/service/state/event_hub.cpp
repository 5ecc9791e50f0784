#include "coordinator/service/state/event_hub.h"

#include <algorithm>
#include <optional>
#include <vector>

#include "common/base/log.h"
#include "coordinator/base/limits.h"

namespace ls::coordinator {

struct EventHub::State {
  struct Listener {
    std::uint64_t next = 0;  // id of the next event for this listener
    std::function<void(const StreamEvent&)> on_event;
  };
  Reserve reserve;
  std::mutex mutex;
  std::condition_variable_any changed;
  std::deque<StreamEvent> kept;  // ascending ids
  std::uint64_t next_id = 1, reserved_end = 1;
  std::map<std::uint64_t, std::shared_ptr<Listener>> listeners;
  std::uint64_t last_listener = 0;
  std::uint64_t calling = 0;  // the listener being called; 0: none
  std::thread::id thread;

  // Makes sure that next_id is reserved. If the store cannot reserve ids now, the next block of ids is used
  // unreserved; a coordinator that starts after a crash may use these ids again.
  void reserve_ids() {
    while (next_id >= reserved_end) {
      const auto first = reserve(limits::kEventIdBlock);
      if (!first) {
        log_warn("", "cannot reserve event ids: " + first.error().message);
        reserved_end = next_id + limits::kEventIdBlock;
        return;
      }
      next_id = std::max(next_id, *first + 1);
      reserved_end = *first + 1 + limits::kEventIdBlock;
    }
  }

  // Returns the next event that a listener has not received, with that listener.
  std::optional<std::pair<std::uint64_t, StreamEvent>> due() {
    if (kept.empty()) return std::nullopt;
    for (auto& [id, listener] : listeners) {
      const std::uint64_t want = std::max(listener->next, kept.front().id);
      if (want > kept.back().id) continue;
      const StreamEvent event = *std::ranges::lower_bound(kept, want, {}, &StreamEvent::id);
      listener->next = event.id + 1;
      return std::pair(id, event);
    }
    return std::nullopt;
  }
};

EventHub::EventHub(Reserve reserve) : state_(std::make_shared<State>()) {
  state_->reserve = std::move(reserve);
  state_->reserve_ids();
  thread_ = std::jthread([state = state_](const std::stop_token& token) { deliver(*state, token); });
  const std::lock_guard lock(state_->mutex);
  state_->thread = thread_.get_id();
}

void EventHub::close() {
  thread_.request_stop();
  if (thread_.joinable()) thread_.join();
}

void EventHub::publish(std::string type, std::string data, std::string job, std::string owner) {
  const std::lock_guard lock(state_->mutex);
  State& s = *state_;
  s.reserve_ids();
  s.kept.push_back({s.next_id++, std::move(type), std::move(data), std::move(job), std::move(owner)});
  if (s.kept.size() > limits::kEventsKept) s.kept.pop_front();
  s.changed.notify_all();
}

std::shared_ptr<void> EventHub::subscribe(std::uint64_t after_id,
                                          std::function<void(const StreamEvent&)> on_event) {
  const std::lock_guard lock(state_->mutex);
  const std::uint64_t id = ++state_->last_listener;
  auto listener = std::make_shared<State::Listener>();
  // If the store was lost and ids began again, `after_id` may be greater than any id given so far. The
  // listener must get new events all the same.
  listener->next = std::min(after_id + 1, state_->next_id);
  listener->on_event = std::move(on_event);
  state_->listeners.emplace(id, std::move(listener));
  state_->changed.notify_all();
  const auto leave = [state = state_, id](void*) {
    std::unique_lock lock(state->mutex);
    state->listeners.erase(id);
    if (std::this_thread::get_id() == state->thread) return;
    state->changed.wait(lock, [&] { return state->calling != id; });
  };
  return {reinterpret_cast<void*>(id), leave};
}

std::uint64_t EventHub::last_id() const {
  const std::lock_guard lock(state_->mutex);
  return state_->next_id - 1;
}

void EventHub::deliver(State& s, const std::stop_token& token) {
  std::unique_lock lock(s.mutex);
  while (!token.stop_requested()) {
    auto next = s.due();
    if (!next) {
      s.changed.wait(lock, token, [&] {
        next = s.due();
        return next.has_value();
      });
      if (!next) return;
    }
    const auto listener = s.listeners.at(next->first);
    s.calling = next->first;
    lock.unlock();
    listener->on_event(next->second);
    lock.lock();
    s.calling = 0;
    s.changed.notify_all();
  }
}

}  // namespace ls::coordinator
