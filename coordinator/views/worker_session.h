// The coordinator's two ends of one worker's stream, and the check whether a worker may join.
#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <utility>

#include "common/protocol/messages.h"

namespace ls::coordinator {

// Sends messages to one worker. Called from any thread; must not block and must not call back.
class WorkerSink {
 public:
  virtual ~WorkerSink() = default;
  virtual void send(ToWorker message) = 0;
  virtual void close() = 0;
};

// One registered stream. After disconnected() nothing more is sent to its sink.
class WorkerSession {
 public:
  virtual ~WorkerSession() = default;
  virtual void receive(FromWorker message) = 0;
  // Without blocking: `next` is called when there is room for another message, at once or later on another
  // thread; never if the coordinator closes first.
  virtual void receive(FromWorker message, std::function<void()> next) {
    receive(std::move(message));
    next();
  }
  virtual void disconnected() = 0;
};

// True if a worker with this token may join. Called from any thread; must not block.
using JoinCheck = std::function<bool(std::string_view token)>;
// Checks against one token; an empty token admits every worker.
JoinCheck join_check(std::string token);

}  // namespace ls::coordinator
