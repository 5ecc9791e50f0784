// The queue of events for the agent's control thread: messages from the coordinator and the loss of the
// connection. Another thread can also wake the control thread without an event (nudge). The link's observer
// shares ownership of the queue, so that a late callback cannot reach a destroyed agent.
#pragma once

#include <condition_variable>
#include <deque>
#include <mutex>
#include <optional>
#include <utility>
#include <variant>

#include "common/base/clock.h"
#include "worker/agent/link.h"

namespace ls::worker {

struct ConnectionLost {
  Error why;
};
struct Arrival {
  // Number of the connection, given by the agent; events of older connections are ignored
  std::uint64_t connection = 0;
  std::variant<ToWorker, ConnectionLost> what;
};

class Inbox {
 public:
  void push(Arrival arrival) {
    const std::lock_guard lock(mutex_);
    arrivals_.push_back(std::move(arrival));
    changed_.notify_one();
  }
  void nudge() {
    const std::lock_guard lock(mutex_);
    nudged_ = true;
    changed_.notify_one();
  }
  // Waits for an event or a nudge, at most this long, and returns all events in the queue.
  std::deque<Arrival> wait(Duration at_most) {
    std::unique_lock lock(mutex_);
    changed_.wait_for(lock, at_most, [this] { return nudged_ || !arrivals_.empty(); });
    nudged_ = false;
    return std::exchange(arrivals_, {});
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Arrival> arrivals_;
  bool nudged_ = false;
};

class InboxObserver final : public LinkObserver {
 public:
  InboxObserver(std::shared_ptr<Inbox> inbox, std::uint64_t connection)
      : inbox_(std::move(inbox)), connection_(connection) {}
  void received(ToWorker message) override { inbox_->push({connection_, std::move(message)}); }
  void lost(Error why) override { inbox_->push({connection_, ConnectionLost{std::move(why)}}); }

 private:
  std::shared_ptr<Inbox> inbox_;
  const std::uint64_t connection_;
};

}  // namespace ls::worker
