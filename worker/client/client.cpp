#include "worker/client/client.h"

#include <fmt/format.h>
#include <grpcpp/grpcpp.h>

#include <condition_variable>
#include <deque>
#include <mutex>
#include <set>

#include "core/base/clock.h"
#include "core/base/guarded.h"
#include "proto/convert.h"
#include "proto/farm.grpc.pb.h"
#include "util/protocol/limits.h"

namespace ls::worker {
namespace pb = ::lightshaft::farm::v1;
namespace {

// Time that one attempt to connect may take, including the TLS handshake. With a shorter limit, handshakes
// over a slow line, or with a coordinator that many workers join at once, would be cut off at every attempt.
// A longer one would delay the next attempt after a broken connection.
constexpr int kConnectMs = 10'000;
constexpr Duration kCloseLimit = std::chrono::seconds(2);

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

// Converts a gRPC status to an Error: the inverse of to_status() in coordinator/rpc/streams.cpp.
Error to_error(const grpc::Status& status) {
  std::string message(status.error_message());
  // gRPC says so of a server that speaks HTTP/1
  if (message.find("http1.x server") != std::string::npos)
    message +=
        ": this is the port for people and programs; workers connect to the one of --grpc, 50051 by default";
  return {code_of(status.error_code()), std::move(message)};
}

// One gRPC stream to the coordinator. Messages to the coordinator are queued; the size of the agent's outbox
// bounds the queue. Messages from the coordinator are passed to the observer. The object keeps itself alive
// from StartCall to OnDone. The link must call close() before it releases the channel.
class WorkCall final : public grpc::ClientBidiReactor<pb::FromWorker, pb::ToWorker> {
 public:
  static std::shared_ptr<WorkCall> start(pb::Farm::Stub& stub, const WorkerHello& hello,
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
    std::deque<pb::FromWorker> queue;
    bool writing = false, closing = false, writes_done = false, held = true, done = false;
    std::optional<Error> broken;  // error in parsing a message; nullopt: none so far
  };
  // Starts the next write. If no message is left and the stream is closing, tells gRPC that no more messages
  // follow.
  void pump(State& state);
  void release_hold(State& state);

  std::shared_ptr<LinkObserver> observer_;                     // null once the stream has ended
  std::shared_ptr<WorkCall> self_;                             // owns this object until OnDone
  std::optional<grpc::ClientContext> context_{std::in_place};  // nullopt once the stream has ended
  pb::ToWorker incoming_;

  Guarded<State> state_;
  std::condition_variable_any done_changed_;
};

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
  done_changed_.wait(state, done);  // short: gRPC ends a cancelled call without waiting for the network
}

void WorkCall::OnReadDone(bool ok) {
  if (!ok) {
    const auto state = state_.lock();
    state->closing = true;
    if (!state->writing) release_hold(*state);
    return;
  }
  // A message of an unknown type is ignored. Only coordinators newer than this worker send one, and they must
  // not rely on an effect of it.
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
  // The context shares ownership of the channel. When the last channel of a process is destroyed, gRPC joins
  // its own threads. This may be one of them, and a thread must not join itself. So this object gives up the
  // channel before it sets `done`, after which the link may destroy the channel.
  context_.reset();
  state->done = true;
  done_changed_.notify_all();
}

std::shared_ptr<grpc::ChannelCredentials> credentials(const std::optional<LinkTls>& tls) {
  if (!tls) return grpc::InsecureChannelCredentials();
  grpc::SslCredentialsOptions options;
  options.pem_root_certs = tls->ca;
  options.pem_cert_chain = tls->cert;
  options.pem_private_key = tls->key;
  return grpc::SslCredentials(options);
}

std::shared_ptr<grpc::Channel> make_channel(const std::string& address, const std::optional<LinkTls>& tls) {
  grpc::ChannelArguments args;
  args.SetMaxReceiveMessageSize(static_cast<int>(limits::kMessageBytes));
  args.SetMaxSendMessageSize(static_cast<int>(limits::kMessageBytes));
  args.SetInt(GRPC_ARG_KEEPALIVE_TIME_MS, limits::kKeepaliveMs);
  args.SetInt(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, limits::kKeepaliveTimeoutMs);
  args.SetInt(GRPC_ARG_KEEPALIVE_PERMIT_WITHOUT_CALLS, 1);
  args.SetInt(GRPC_ARG_HTTP2_MAX_PINGS_WITHOUT_DATA, 0);
  // gRPC's pauses between attempts to connect must not be longer than those that the agent makes itself.
  args.SetInt(GRPC_ARG_INITIAL_RECONNECT_BACKOFF_MS, 100);
  args.SetInt(GRPC_ARG_MIN_RECONNECT_BACKOFF_MS, kConnectMs);
  args.SetInt(GRPC_ARG_MAX_RECONNECT_BACKOFF_MS, 1000);
  args.SetInt(GRPC_ARG_ENABLE_HTTP_PROXY, 0);
  args.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
  return grpc::CreateCustomChannel(address, credentials(tls), args);
}

class GrpcLink final : public CoordinatorLink {
 public:
  GrpcLink(const std::string& address, std::string join_token, const std::optional<LinkTls>& tls)
      : join_token_(std::move(join_token)),
        channel_(make_channel(address, tls)),
        stub_(pb::Farm::NewStub(channel_)) {}
  ~GrpcLink() override { close(); }

  Result<void> connect(const WorkerHello& hello, std::shared_ptr<LinkObserver> observer) override {
    close();
    auto call = WorkCall::start(*stub_, hello, std::move(observer));
    const std::lock_guard lock(mutex_);
    call_ = std::move(call);
    closed_ = false;
    return {};
  }

  void send(FromWorker message) override {
    std::shared_ptr<WorkCall> call;
    {
      const std::lock_guard lock(mutex_);
      call = call_;
    }
    if (call) call->send(message);
  }

  void close() override {
    std::shared_ptr<WorkCall> call;
    {
      const std::lock_guard lock(mutex_);
      closed_ = true;
      for (grpc::ClientContext* fetch : fetches_) fetch->TryCancel();
      call = std::move(call_);
    }
    if (call) call->close(kCloseLimit);
  }

  Result<void> fetch_blob(const BlobRequest& wanted, const BlobSink& sink) override {
    grpc::ClientContext context;
    {
      const std::lock_guard lock(mutex_);
      if (closed_) return fail(Errc::unavailable, "not connected");
      fetches_.insert(&context);
    }
    pb::FetchBlobRequest request;
    request.set_digest(wire::digest_bytes(wanted.digest));
    request.set_offset(wanted.offset);
    request.set_arrived_wrong(wanted.arrived_wrong);
    request.set_join_token(join_token_);
    auto reader = stub_->FetchBlob(&context, request);
    pb::BlobChunk chunk;
    Result<void> taken;
    while (taken && reader->Read(&chunk))
      taken = sink({reinterpret_cast<const std::byte*>(chunk.data().data()), chunk.data().size()});
    if (!taken) context.TryCancel();
    const grpc::Status status = reader->Finish();
    {
      const std::lock_guard lock(mutex_);
      fetches_.erase(&context);
    }
    if (!taken) return taken;
    if (!status.ok()) return tl::unexpected<Error>(to_error(status));
    return {};
  }

 private:
  const std::string join_token_;
  const std::shared_ptr<grpc::Channel> channel_;
  const std::unique_ptr<pb::Farm::Stub> stub_;
  std::mutex mutex_;
  std::shared_ptr<WorkCall> call_;
  std::set<grpc::ClientContext*> fetches_;
  bool closed_ = true;
};

}  // namespace

std::unique_ptr<CoordinatorLink> make_grpc_link(const std::string& address, const std::string& join_token,
                                                const std::optional<LinkTls>& tls) {
  return std::make_unique<GrpcLink>(address, join_token, tls);
}

}  // namespace ls::worker
