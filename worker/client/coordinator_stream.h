// One gRPC stream to the coordinator. Messages to the coordinator are queued; the size of the agent's outbox
// bounds the queue. Messages from the coordinator are passed to the observer. The object keeps itself alive
// from StartCall to OnDone. The link must call close() before it releases the channel.
#pragma once

#include <condition_variable>
#include <deque>
#include <memory>
#include <optional>

#include "common/base/clock.h"
#include "common/base/guarded.h"
#include "proto/farm.grpc.pb.h"
#include "worker/agent/link.h"

namespace ls::worker {

// Converts a gRPC status to an Error: the inverse of to_status() in coordinator/rpc/streams.cpp.
Error to_error(const grpc::Status& status);

class WorkCall final
    : public grpc::ClientBidiReactor<lightshaft::farm::v1::FromWorker, lightshaft::farm::v1::ToWorker> {
 public:
  static std::shared_ptr<WorkCall> start(lightshaft::farm::v1::Farm::Stub& stub, const WorkerHello& hello,
                                         std::shared_ptr<LinkObserver> observer);

  void send(const FromWorker& message);
  // Sends the queued messages, ends the stream, and waits until it has ended and the observer has been
  // notified. If that takes longer than `at_most`, the stream is cancelled. Must not be called by the
  // observer.
  void close(Duration at_most);

  void OnReadDone(bool ok) override;
  void OnWriteDone(bool ok) override;
  void OnDone(const grpc::Status& status) override;

 private:
  explicit WorkCall(std::shared_ptr<LinkObserver> observer) : observer_(std::move(observer)) {}
  struct State {
    std::deque<lightshaft::farm::v1::FromWorker> queue;
    bool writing = false, closing = false, writes_done = false, held = true, done = false;
    std::optional<Error> broken;  // error of a message that could not be parsed
  };
  void pump(State& state);  // starts the next write, or ends the writes
  void release_hold(State& state);

  std::shared_ptr<LinkObserver> observer_;                     // null once the stream has ended
  std::shared_ptr<WorkCall> self_;                             // owns this object until OnDone
  std::optional<grpc::ClientContext> context_{std::in_place};  // nullopt once the stream has ended
  lightshaft::farm::v1::ToWorker incoming_;

  Guarded<State> state_;
  std::condition_variable_any done_changed_;
};

}  // namespace ls::worker
