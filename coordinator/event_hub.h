// Events to whoever listens: numbered, kept in a bounded ring for those who come back, delivered in order by
// a thread of its own, so that no listener runs under a lock of the service.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <thread>

#include "coordinator/service.h"

namespace ls::coordinator {

class EventHub {
 public:
  // Reserves the next ids durably, so that an id never comes twice, whatever happens: returns the first of
  // `count`.
  using Reserve = std::function<Result<std::uint64_t>(std::uint64_t count)>;
  explicit EventHub(Reserve reserve);
  ~EventHub();

  void publish(std::string type, std::string data, std::string job, std::string owner = {});
  // Listeners are called after publish() returns, from the hub's thread. Once the handle is gone no call is
  // under way (unless it is destroyed by its own callback). The handle may outlive the hub.
  std::shared_ptr<void> subscribe(std::uint64_t after_id, std::function<void(const StreamEvent&)> on_event);
  std::uint64_t last_id() const;

 private:
  struct State;
  static void deliver(State& state, const std::stop_token& token);
  std::shared_ptr<State> state_;
  std::jthread thread_;
};

}  // namespace ls::coordinator
