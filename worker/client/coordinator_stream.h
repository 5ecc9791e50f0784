// One gRPC stream to the coordinator. Messages to the coordinator are queued, bounded by the size of the
// agent's outbox; messages from it are passed to the observer. The object keeps itself alive from StartCall
// to OnDone, so that the link may drop its pointer at any time.
#pragma once

#include <condition_variable>
#include <deque>
#include <memory>
#include <mutex>

#include "common/base/clock.h"
#include "proto/farm.grpc.pb.h"
#include "worker/agent/link.h"

namespace ls::worker {

class WorkCall final
    : public grpc::ClientBidiReactor<lightshaft::farm::v1::FromWorker, lightshaft::farm::v1::ToWorker> {
 public:
  static std::shared_ptr<WorkCall> start(lightshaft::farm::v1::Farm::Stub& stub, const WorkerHello& hello,
                                         std::shared_ptr<LinkObserver> observer);

  void send(const FromWorker& message);
  // Sends the queued messages, ends the stream and waits until it has ended. If that takes longer than
  // `at_most`, the stream is cancelled. Must not be called from one of the On... functions below.
  void close(Duration at_most);

  void OnReadDone(bool ok) override;
  void OnWriteDone(bool ok) override;
  void OnDone(const grpc::Status& status) override;

 private:
  explicit WorkCall(std::shared_ptr<LinkObserver> observer) : observer_(std::move(observer)) {}
  void pump_locked();
  void release_hold_locked();

  const std::shared_ptr<LinkObserver> observer_;
  std::shared_ptr<WorkCall> self_;  // until OnDone
  grpc::ClientContext context_;
  lightshaft::farm::v1::ToWorker incoming_;

  std::mutex mutex_;
  std::condition_variable done_changed_;
  std::deque<lightshaft::farm::v1::FromWorker> queue_;
  bool writing_ = false, closing_ = false, writes_done_ = false, held_ = true, done_ = false;
  std::optional<Error> broken_;  // set by a message that could not be parsed
};

}  // namespace ls::worker
