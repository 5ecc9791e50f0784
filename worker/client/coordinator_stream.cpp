#include "worker/client/coordinator_stream.h"

#include "proto/convert.h"
#include "worker/client/status.h"

namespace ls::worker {
namespace pb = ::lightshaft::farm::v1;

std::shared_ptr<WorkCall> WorkCall::start(pb::Farm::Stub& stub, const WorkerHello& hello,
                                          std::shared_ptr<LinkObserver> observer) {
  std::shared_ptr<WorkCall> call(new WorkCall(std::move(observer)));
  call->self_ = call;
  call->context_.set_wait_for_ready(false);
  stub.async()->Work(&call->context_, call.get());
  call->AddHold();  // keeps the call open for writes that are started outside of the On... functions
  call->StartRead(&call->incoming_);
  call->send(hello);
  call->StartCall();
  return call;
}

void WorkCall::send(const FromWorker& message) {
  pb::FromWorker wire = wire::to_wire(message);
  const std::lock_guard lock(mutex_);
  if (closing_ || done_) return;
  queue_.push_back(std::move(wire));
  pump_locked();
}

void WorkCall::pump_locked() {
  if (writing_ || writes_done_ || !held_) return;
  if (!queue_.empty()) {
    writing_ = true;
    StartWrite(&queue_.front());
  } else if (closing_) {
    writes_done_ = true;
    StartWritesDone();
    release_hold_locked();
  }
}

void WorkCall::release_hold_locked() {
  if (!held_) return;
  held_ = false;
  RemoveHold();
}

void WorkCall::close(Duration at_most) {
  std::unique_lock lock(mutex_);
  closing_ = true;
  pump_locked();
  if (done_changed_.wait_for(lock, at_most, [this] { return done_; })) return;
  context_.TryCancel();
  release_hold_locked();
}

void WorkCall::OnReadDone(bool ok) {
  if (!ok) {
    const std::lock_guard lock(mutex_);
    closing_ = true;
    if (!writing_) release_hold_locked();
    return;
  }
  // A kind of message that only newer versions know: a newer coordinator must not depend on our handling it.
  if (!wire::known(incoming_)) {
    StartRead(&incoming_);
    return;
  }
  auto message = wire::from_wire(incoming_);
  if (!message) {
    const std::lock_guard lock(mutex_);
    broken_ = message.error();
    closing_ = true;
    context_.TryCancel();
    if (!writing_) release_hold_locked();
    return;
  }
  observer_->received(std::move(*message));
  StartRead(&incoming_);
}

void WorkCall::OnWriteDone(bool ok) {
  const std::lock_guard lock(mutex_);
  writing_ = false;
  queue_.pop_front();
  if (!ok) {
    queue_.clear();
    closing_ = true;
    release_hold_locked();
    return;
  }
  pump_locked();
}

void WorkCall::OnDone(const grpc::Status& status) {
  std::shared_ptr<WorkCall> self;
  Error why = status.ok() ? Error{Errc::unavailable, "the coordinator ended the stream"} : to_error(status);
  {
    const std::lock_guard lock(mutex_);
    if (broken_) why = *broken_;
    done_ = true;
    self = std::move(self_);
    done_changed_.notify_all();
  }
  observer_->lost(std::move(why));
}

}  // namespace ls::worker
