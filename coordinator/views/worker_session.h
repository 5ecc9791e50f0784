// The two directions of the message stream between the coordinator and one worker: the coordinator sends
// through a WorkerSink and receives through a WorkerSession. JoinCheck decides whether a worker may join.
#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <utility>

#include "util/protocol/messages.h"

namespace ls::coordinator {

// Sends messages to one worker. Its functions may be called from any thread; they must not block and must not
// call back into the coordinator.
class WorkerSink {
 public:
  virtual ~WorkerSink() = default;
  virtual void send(ToWorker message) = 0;
  virtual void close() = 0;
};

// The stream of one worker that has joined. After disconnected() the coordinator sends nothing more to the
// worker's sink.
class WorkerSession {
 public:
  virtual ~WorkerSession() = default;
  virtual void receive(FromWorker message) = 0;
  // Takes a message without blocking. Calls `next` as soon as the coordinator has room for another message of
  // this worker: before receive() returns, or later on another thread. If the coordinator closes the stream
  // before that, it never calls `next`.
  virtual void receive(FromWorker message, std::function<void()> next) = 0;
  virtual void disconnected() = 0;
};

// A function that returns true if a worker that presents this token may join. It may be called from any
// thread and must not block.
using JoinCheck = std::function<bool(std::string_view token)>;
// Returns a check that admits the workers that present exactly this token. If the token is empty, the check
// admits every worker.
JoinCheck join_check(std::string token);

}  // namespace ls::coordinator
