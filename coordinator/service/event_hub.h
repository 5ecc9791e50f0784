// Publishes events to listeners: numbered, kept in a bounded ring for readers that reconnect, and delivered
// in order on a separate thread, so that no listener runs under a lock of the service.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <thread>

#include "coordinator/views/job_view.h"

namespace ls::coordinator {

class EventHub {
 public:
  // Durably reserves the next `count` ids, so that no id is ever used twice, and returns the first of them.
  using Reserve = std::function<Result<std::uint64_t>(std::uint64_t count)>;
  explicit EventHub(Reserve reserve);
  ~EventHub();

  void publish(std::string type, std::string data, std::string job, std::string owner = {});
  // Listeners are called from the hub's thread, after publish() returns. Once the handle is destroyed no call
  // is in progress (unless its own callback destroyed it). The handle may outlive the hub.
  std::shared_ptr<void> subscribe(std::uint64_t after_id, std::function<void(const StreamEvent&)> on_event);
  std::uint64_t last_id() const;

 private:
  struct State;
  static void deliver(State& state, const std::stop_token& token);
  std::shared_ptr<State> state_;
  std::jthread thread_;
};

}  // namespace ls::coordinator
