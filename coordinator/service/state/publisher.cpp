#include "coordinator/service/state/publisher.h"

#include <algorithm>
#include <condition_variable>
#include <deque>
#include <map>
#include <mutex>
#include <optional>
#include <utility>

#include "coordinator/base/limits.h"
#include "coordinator/views/views.h"
#include "core/base/log.h"

namespace ls::coordinator {

struct EventHub::State {
  struct Listener {
    std::uint64_t next = 0;  // id of the next event for this listener
    std::function<void(const StreamEvent&)> on_event;
  };
  Reserve reserve;
  std::mutex mutex;
  std::condition_variable_any changed;
  std::deque<StreamEvent> kept;  // the latest events, in the order of their ids
  std::uint64_t next_id = 1, reserved_end = 1;
  std::map<std::uint64_t, std::shared_ptr<Listener>> listeners;
  std::uint64_t last_listener = 0;
  std::uint64_t calling = 0;  // number of the listener that is being called; 0: none is
  std::thread::id thread;

  // Makes sure that next_id is reserved in the store, in blocks of kEventIdBlock ids. If the store cannot
  // reserve a block now, the ids of the block are used without a reservation; after a crash the coordinator
  // may then use the same ids again.
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

  // Finds a listener that has not received all kept events. Returns its number and its next event.
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
  // If the store was lost, ids begin at 1 again, and a reader's `after_id` from before may be greater than
  // every present id. min() makes sure that such a reader gets the new events too.
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

void Publisher::job(JobEntry& entry) {
  entry.published.due = false;
  entry.published.at = clock_.now();
  if (quiet_) return;
  const JobView view = views_.job(entry);
  hub_.publish("job", job_json(view), entry.stored.id.value, entry.stored.owner);
  if (const auto frame = frame_of(entry.stored.id)) {
    const bool changed = std::exchange(entry.published.state, view.state) != view.state;
    sequence(frame->sequence, changed && !records_.puts_together());
  }
}

void Publisher::progress(JobEntry& entry) {
  entry.published.due = seconds(clock_.now() - entry.published.at) < limits::kProgressSeconds;
  if (!entry.published.due) job(entry);
}

void Publisher::sequence(const JobId& id, bool at_once) {
  Sequence* sequence = jobs_.sequence(id);
  if (!sequence || quiet_) return;
  // An event of a sequence takes longer to make the more frames it has. So a sequence of more than
  // kFramesPerEvent frames is published at most once per `period` (in seconds), even with `at_once`.
  at_once &= sequence->frames.size() <= limits::kFramesPerEvent;
  const double period = limits::kProgressSeconds * (1 + static_cast<double>(sequence->frames.size()) /
                                                            static_cast<double>(limits::kFramesPerEvent));
  sequence->published.due = !at_once && seconds(clock_.now() - sequence->published.at) < period;
  if (sequence->published.due) return;
  sequence->published.at = clock_.now();
  hub_.publish("job", job_json(views_.sequence(id, *sequence, false)), id.value,
               sequence->frames.front()->stored.owner);
}

void Publisher::publish_due() {
  for (const auto& [id, entry] : jobs_.all())
    if (entry->published.due) progress(*entry);
  for (const auto& [id, due] : jobs_.sequences())
    if (due.published.due) sequence(id, false);
}

void Publisher::job_removed(const JobId& id, const std::string& owner) {
  hub_.publish("job", job_removed_json(id), id.value, owner);
}

void Publisher::job_moved(const JobId& id, const std::string& owner) {
  hub_.publish("job", job_moved_json(id), id.value, owner);
}

void Publisher::tile(const JobEntry& entry, TileIndex tile, const PixelRect& rect, std::string_view state,
                     std::uint64_t spp, const WorkerId& worker) {
  const JobId& id = entry.stored.id;
  hub_.publish("tile", tile_event_json(id, tile, rect, state, spp, worker.value), id.value,
               entry.stored.owner);
}

void Publisher::worker(const WorkerId& id, bool at_once) {
  const auto found = workers_.find(id);
  if (found == workers_.end()) return;
  if (!at_once && seconds(clock_.now() - found->second.last_event) < 1) return;
  found->second.last_event = clock_.now();
  const WorkerView view = views_.worker(id, found->second);
  const auto job = jobs_.find(JobId{view.job});
  hub_.publish("worker", worker_json(view), "", job ? job->stored.owner : "");
}

void Publisher::worker_gone(const WorkerId& id) { hub_.publish("worker", worker_gone_json(id), ""); }

}  // namespace ls::coordinator
