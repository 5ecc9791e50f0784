#include "coordinator/rpc/work_stream.h"

#include <fmt/format.h>

#include "common/base/log.h"
#include "coordinator/rpc/grpc_status.h"
#include "proto/convert.h"

namespace ls::coordinator::rpc {
namespace {
// At most this many messages wait for a worker that does not read them; if there are more, the worker is
// disconnected
constexpr std::size_t kQueuedMessages = 8192;
}  // namespace

void Outlet::send(ToWorker message) {
  pb::ToWorker wire = wire::to_wire(message);
  const auto state = state_.lock();
  if (!state->stream || state->closing || state->finished) return;
  if (state->queue.size() >= kQueuedMessages) {
    state->closing = true;
    state->stream->context_->TryCancel();
    return;
  }
  state->queue.push_back(std::move(wire));
  state->pump();
}

void Outlet::close() {
  state_.lock()->end(grpc::Status(grpc::StatusCode::UNAVAILABLE, "the coordinator closed this stream"));
}

void Outlet::State::end(const grpc::Status& with) {
  if (!stream || closing || finished) return;
  closing = true;
  status = with;
  pump();
}

void Outlet::State::pump() {
  if (writing || finished) return;
  if (!queue.empty()) {
    writing = true;
    stream->StartWrite(&queue.front());
  } else if (closing) {
    finished = true;
    stream->Finish(status);
  }
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

void WorkStream::end(const grpc::Status& status) { outlet_->state_.lock()->end(status); }

void WorkStream::cut() {
  const auto out = outlet_->state_.lock();
  if (!out->finished) context_->TryCancel();
}

void WorkStream::OnReadDone(bool ok) {
  if (!ok) {  // the worker has closed its side, or has vanished
    end(grpc::Status::OK);
    return;
  }
  // A message of an unknown kind comes from a newer worker and is ignored; workers must not rely on messages
  // that older coordinators do not know
  if (greeted_ && !wire::known(incoming_)) {
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
  // The callback uses the outlet, because this stream may be deleted before there is room for the next
  // message.
  session_->receive(std::move(*message), [outlet = outlet_] { outlet->read_on(); });
}

// Starts to read the worker's next message; no thread waits for it. gRPC does not delete the stream before
// Finish is called, so it may be used here until then.
void Outlet::read_on() {
  const auto state = state_.lock();
  if (state->stream && !state->finished) state->stream->StartRead(&state->stream->incoming_);
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
  const auto out = outlet_->state_.lock();
  out->writing = false;
  out->queue.pop_front();
  if (!ok) {
    out->queue.clear();
    out->closing = true;
  }
  out->pump();
}

void WorkStream::OnCancel() {
  const auto out = outlet_->state_.lock();
  out->closing = true;
  while (out->queue.size() > (out->writing ? 1U : 0U)) out->queue.pop_back();
  out->pump();
}

void WorkStream::OnDone() {
  {
    const auto out = outlet_->state_.lock();
    out->stream = nullptr;
    out->queue.clear();
  }
  if (session_) session_->disconnected();
  session_.reset();
  on_gone_(this);
  delete this;
}

}  // namespace ls::coordinator::rpc
