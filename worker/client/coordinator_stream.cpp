#include "worker/client/coordinator_stream.h"

#include "proto/convert.h"

namespace ls::worker {
namespace pb = ::lightshaft::farm::v1;

namespace {

Errc code_of(grpc::StatusCode code) {
  switch (code) {
    case grpc::StatusCode::INVALID_ARGUMENT:
    case grpc::StatusCode::OUT_OF_RANGE:
      return Errc::invalid_argument;
    case grpc::StatusCode::NOT_FOUND:
      return Errc::not_found;
    case grpc::StatusCode::ALREADY_EXISTS:
      return Errc::already_exists;
    case grpc::StatusCode::FAILED_PRECONDITION:
      return Errc::failed_precondition;
    case grpc::StatusCode::RESOURCE_EXHAUSTED:
      return Errc::resource_exhausted;
    case grpc::StatusCode::PERMISSION_DENIED:
      return Errc::permission_denied;
    case grpc::StatusCode::UNAUTHENTICATED:
      return Errc::unauthenticated;
    // The coordinator vanished, was unreachable or shut down: the caller should try again later.
    case grpc::StatusCode::UNAVAILABLE:
    case grpc::StatusCode::CANCELLED:
    case grpc::StatusCode::ABORTED:
    case grpc::StatusCode::DEADLINE_EXCEEDED:
      return Errc::unavailable;
    default:
      return Errc::internal;
  }
}

}  // namespace

Error to_error(const grpc::Status& status) {
  return {code_of(status.error_code()), std::string(status.error_message())};
}

std::shared_ptr<WorkCall> WorkCall::start(pb::Farm::Stub& stub, const WorkerHello& hello,
                                          std::shared_ptr<LinkObserver> observer) {
  std::shared_ptr<WorkCall> call(new WorkCall(std::move(observer)));
  call->self_ = call;
  call->context_->set_wait_for_ready(false);
  stub.async()->Work(&*call->context_, call.get());
  call->AddHold();  // keeps the call open for writes that are started outside of gRPC's callbacks
  call->StartRead(&call->incoming_);
  call->send(hello);
  call->StartCall();
  return call;
}

void WorkCall::send(const FromWorker& message) {
  pb::FromWorker wire = wire::to_wire(message);
  const auto state = state_.lock();
  if (state->closing || state->done) return;
  state->queue.push_back(std::move(wire));
  pump(*state);
}

void WorkCall::pump(State& state) {
  if (state.writing || state.writes_done || !state.held) return;
  if (!state.queue.empty()) {
    state.writing = true;
    StartWrite(&state.queue.front());
  } else if (state.closing) {
    state.writes_done = true;
    StartWritesDone();
    release_hold(state);
  }
}

void WorkCall::release_hold(State& state) {
  if (!state.held) return;
  state.held = false;
  RemoveHold();
}

void WorkCall::close(Duration at_most) {
  auto state = state_.lock();
  state->closing = true;
  pump(*state);
  const auto done = [&] { return state->done; };
  if (done_changed_.wait_for(state, at_most, done)) return;
  context_->TryCancel();
  release_hold(*state);
  done_changed_.wait(state, done);  // short: a cancelled call ends here, whatever the network does
}

void WorkCall::OnReadDone(bool ok) {
  if (!ok) {
    const auto state = state_.lock();
    state->closing = true;
    if (!state->writing) release_hold(*state);
    return;
  }
  // A message of an unknown type, which only newer coordinators send, is ignored: they must not rely on it.
  if (!wire::known(incoming_)) {
    StartRead(&incoming_);
    return;
  }
  auto message = wire::from_wire(incoming_);
  if (!message) {
    const auto state = state_.lock();
    state->broken = message.error();
    state->closing = true;
    context_->TryCancel();
    if (!state->writing) release_hold(*state);
    return;
  }
  observer_->received(std::move(*message));
  StartRead(&incoming_);
}

void WorkCall::OnWriteDone(bool ok) {
  const auto state = state_.lock();
  state->writing = false;
  state->queue.pop_front();
  if (!ok) {
    state->queue.clear();
    state->closing = true;
    release_hold(*state);
    return;
  }
  pump(*state);
}

void WorkCall::OnDone(const grpc::Status& status) {
  Error why = status.ok() ? Error{Errc::unavailable, "the coordinator ended the stream"} : to_error(status);
  if (const auto state = state_.lock(); state->broken) why = *state->broken;
  observer_->lost(std::move(why));
  observer_.reset();
  const std::shared_ptr<WorkCall> self = std::move(self_);
  const auto state = state_.lock();
  // The context shares ownership of the channel. When the last channel of a process ends, gRPC joins its
  // threads, and this may be one of them. So only the link may own the channel once `done` is true.
  context_.reset();
  state->done = true;
  done_changed_.notify_all();
}

}  // namespace ls::worker
