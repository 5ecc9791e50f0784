#include "coordinator/rpc/work_stream.h"

#include <fmt/format.h>

#include "common/base/log.h"
#include "coordinator/rpc/grpc_status.h"
#include "coordinator/rpc/limits.h"
#include "proto/convert.h"

namespace ls::coordinator::rpc {

void Outlet::send(ToWorker message) {
  pb::ToWorker wire = wire::to_wire(message);
  const std::lock_guard lock(mutex_);
  if (!stream_ || closing_ || finished_) return;
  if (queue_.size() >= kQueuedMessages) {
    closing_ = true;
    stream_->context_->TryCancel();
    return;
  }
  queue_.push_back(std::move(wire));
  stream_->pump_locked();
}

void Outlet::close() {
  const std::lock_guard lock(mutex_);
  if (!stream_ || closing_ || finished_) return;
  closing_ = true;
  status_ = grpc::Status(grpc::StatusCode::UNAVAILABLE, "the coordinator closed this stream");
  stream_->pump_locked();
}

WorkStream::WorkStream(Coordinator& coordinator, grpc::CallbackServerContext* context, const JoinGuard& guard,
                       TimePoint hello_deadline, std::function<void(WorkStream*)> on_gone)
    : coordinator_(coordinator),
      context_(context),
      guard_(guard),
      hello_deadline_(hello_deadline),
      on_gone_(std::move(on_gone)),
      outlet_(std::make_shared<Outlet>(this)) {}

void WorkStream::refuse(const Error& error, bool retry) {
  outlet_->send(Refused{error, retry});
  end(to_status(error));
}

void WorkStream::end(const grpc::Status& status) {
  const std::lock_guard lock(outlet_->mutex_);
  if (outlet_->closing_ || outlet_->finished_) return;
  outlet_->closing_ = true;
  outlet_->status_ = status;
  pump_locked();
}

void WorkStream::cut() {
  const std::lock_guard lock(outlet_->mutex_);
  if (!outlet_->finished_) context_->TryCancel();
}

void WorkStream::pump_locked() {
  Outlet& out = *outlet_;
  if (out.writing_ || out.finished_) return;
  if (!out.queue_.empty()) {
    out.writing_ = true;
    StartWrite(&out.queue_.front());
  } else if (out.closing_) {
    out.finished_ = true;
    Finish(out.status_);
  }
}

void WorkStream::OnReadDone(bool ok) {
  if (!ok) {  // the worker has closed its side, or has vanished
    end(grpc::Status::OK);
    return;
  }
  if (greeted_ && !wire::known(incoming_)) {  // a newer worker's message: newer workers must not depend on it
    StartRead(&incoming_);
    return;
  }
  auto message = wire::from_wire(incoming_);
  if (!message) {
    log_warn("peer=" + context_->peer(), message.error().message);
    refuse(message.error(), false);
    return;
  }
  if (!session_) {
    greet(std::move(*message));
    if (session_) StartRead(&incoming_);
    return;
  }
  // The outlet outlives this stream, which may be gone when there is room again.
  session_->receive(std::move(*message), [outlet = outlet_] { outlet->read_on(); });
}

// Starts to read the worker's next message; no thread waits for it. The stream cannot be deleted before
// Finish was called, so it may be used here until then.
void Outlet::read_on() {
  const std::lock_guard lock(mutex_);
  if (stream_ && !finished_) stream_->StartRead(&stream_->incoming_);
}

void WorkStream::greet(FromWorker message) {
  const auto* hello = std::get_if<WorkerHello>(&message);
  if (!hello)
    return refuse({Errc::invalid_argument, "bad message: the first one on a stream must be the hello"},
                  false);
  if (hello->protocol != kProtocolVersion) {
    const Error other{
        Errc::failed_precondition,
        fmt::format("this worker speaks protocol {}, the coordinator speaks {}: install the same "
                    "version on both",
                    hello->protocol, kProtocolVersion)};
    log_warn(fmt::format("peer={} worker={} build={}", context_->peer(), log_value(hello->name),
                         log_value(hello->build)),
             "refused: " + other.message);
    return refuse(other, false);
  }
  const std::string address = address_of_peer(context_->peer());
  if (const int wait = guard_.wait(address, hello->join_token); wait > 0) {
    log_warn("peer=" + context_->peer(), "refused: too many wrong join tokens came from its address");
    return refuse({Errc::resource_exhausted, too_many_wrong_tokens(wait)}, true);
  }
  auto session = coordinator_.connect(*hello, outlet_);
  if (session || session.error().code == Errc::unauthenticated)
    guard_.tried(address, hello->join_token, session.has_value());
  if (!session) {
    log_warn(fmt::format("peer={} worker={}", context_->peer(), log_value(hello->name)),
             "refused: " + session.error().message);
    return refuse(session.error(), session.error().code == Errc::unavailable ||
                                       session.error().code == Errc::resource_exhausted);
  }
  session_ = std::move(*session);
  greeted_ = true;
}

void WorkStream::OnWriteDone(bool ok) {
  const std::lock_guard lock(outlet_->mutex_);
  outlet_->writing_ = false;
  outlet_->queue_.pop_front();
  if (!ok) {
    outlet_->queue_.clear();
    outlet_->closing_ = true;
  }
  pump_locked();
}

void WorkStream::OnCancel() {
  const std::lock_guard lock(outlet_->mutex_);
  outlet_->closing_ = true;
  while (outlet_->queue_.size() > (outlet_->writing_ ? 1U : 0U)) outlet_->queue_.pop_back();
  pump_locked();
}

void WorkStream::OnDone() {
  {
    const std::lock_guard lock(outlet_->mutex_);
    outlet_->stream_ = nullptr;
    outlet_->queue_.clear();
  }
  if (session_) session_->disconnected();
  session_.reset();
  on_gone_(this);
  delete this;
}

}  // namespace ls::coordinator::rpc
