// Publishes events to listeners. Events are numbered, and the latest ones are kept for readers that
// reconnect. Listeners are called in order on a separate thread, so no listener runs under a lock of the
// service.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <thread>

#include "coordinator/views/views.h"

namespace ls::coordinator {

class EventHub {
 public:
  // Durably reserves the next `count` ids, so that no id is ever used twice. Returns the number before the
  // first of them.
  using Reserve = std::function<Result<std::uint64_t>(std::uint64_t count)>;
  explicit EventHub(Reserve reserve);
  ~EventHub() { close(); }
  void close();  // waits until no listener is being called; afterwards no listener is called any more

  void publish(std::string type, std::string data, std::string job, std::string owner = {});
  // Calls `on_event` for every kept event with an id above `after_id`, then for new ones. The calls come from
  // the hub's thread, after publish() returns. The subscription ends when the returned handle is destroyed.
  // After that no call is in progress (unless the callback itself destroyed the handle). The handle may
  // outlive the hub.
  std::shared_ptr<void> subscribe(std::uint64_t after_id, std::function<void(const StreamEvent&)> on_event);
  std::uint64_t last_id() const;

 private:
  struct State;
  static void deliver(State& state, const std::stop_token& token);
  std::shared_ptr<State> state_;
  std::jthread thread_;
};

}  // namespace ls::coordinator
