// WorkStream with its Outlet, and BlobStream: the gRPC reactors (objects that serve one call each) for a
// worker's stream of messages and for its fetches of blobs (files of scenes).
#include "coordinator/rpc/streams.h"

#include <fmt/format.h>
#include <grpc/grpc_security_constants.h>

#include <algorithm>
#include <utility>

#include "coordinator/rpc/principal.h"
#include "core/base/log.h"
#include "proto/convert.h"
#include "util/protocol/limits.h"

namespace ls::coordinator::rpc {
namespace {

// At most this many messages to one worker wait until it reads them. A worker for which one more would have
// to wait is disconnected.
constexpr std::size_t kQueuedMessages = 8192;

// Returns the gRPC status for an error. No other function maps Errc to gRPC status codes.
grpc::Status to_status(const Error& error) {
  using enum grpc::StatusCode;
  static constexpr std::pair<Errc, grpc::StatusCode> kCodes[] = {
      {Errc::invalid_argument, INVALID_ARGUMENT},     {Errc::not_found, NOT_FOUND},
      {Errc::already_exists, ALREADY_EXISTS},         {Errc::failed_precondition, FAILED_PRECONDITION},
      {Errc::resource_exhausted, RESOURCE_EXHAUSTED}, {Errc::permission_denied, PERMISSION_DENIED},
      {Errc::unauthenticated, UNAUTHENTICATED},       {Errc::unavailable, UNAVAILABLE}};
  for (const auto& [code, status] : kCodes)
    if (code == error.code) return {status, error.message};
  return {INTERNAL, error.message};
}

std::string_view to_view(const grpc::string_ref& text) { return {text.data(), text.size()}; }

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
                       std::unique_ptr<Listener::Call> call, TimePoint hello_deadline,
                       std::function<void(WorkStream*)> on_gone)
    : coordinator_(coordinator),
      context_(context),
      guard_(guard),
      call_(std::move(call)),
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
  // A message of an unknown kind comes from a newer worker and is ignored. So a newer worker must also work
  // with a coordinator that ignores its new kinds of messages.
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
  // The session calls the callback when there is room for the worker's next message. This stream may have
  // been deleted by then; so the callback holds the Outlet, which knows whether the stream still exists.
  session_->receive(std::move(*message), [outlet = outlet_] { outlet->read_on(); });
}

// Starts to read the worker's next message; no thread waits for it. The stream deletes itself in OnDone,
// which gRPC calls only after Finish. So while `finished` is false, the stream exists.
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
  const auto shown = context_->auth_context()->FindPropertyValues(GRPC_X509_PEM_CERT_PROPERTY_NAME);
  const std::string_view certificate = shown.empty() ? std::string_view{} : to_view(shown.front());
  auto session = coordinator_.connect(*hello, outlet_, principal_of(context_->peer(), certificate));
  if (session || session.error().code == Errc::unauthenticated)
    guard_.tried(address, hello->join_token, session.has_value());
  if (!session) {
    log_warn(fmt::format("peer={} worker={}", context_->peer(), log_value(hello->name)),
             "refused: " + session.error().message);
    return refuse(session.error(), session.error().code == Errc::unavailable ||
                                       session.error().code == Errc::resource_exhausted);
  }
  session_ = std::move(*session);
  call_->met();
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

BlobStream::BlobStream(Coordinator& coordinator, grpc::CallbackServerContext* context,
                       const pb::FetchBlobRequest& request, const JoinCheck& may_join,
                       std::unique_ptr<Listener::Call> call, RunOn run, Watcher watcher)
    : coordinator_(coordinator),
      context_(context),
      blobs_(coordinator.blobs()),
      request_(request),
      may_join_(may_join),
      call_(std::move(call)),
      run_(std::move(run)),
      watcher_(std::move(watcher)) {}

// Here and in the functions below, no member may be used after StartWrite() or Finish(): OnDone, which
// deletes this object, may run immediately.
void BlobStream::begin(const JoinGuard& guard) {
  const std::string address = address_of_peer(context_->peer());
  if (const int wait = guard.wait(address, request_.join_token()); wait > 0)
    return Finish({grpc::StatusCode::RESOURCE_EXHAUSTED, too_many_wrong_tokens(wait)});
  const bool right = may_join_(request_.join_token());
  guard.tried(address, request_.join_token(), right);
  if (!right)
    return Finish(
        {grpc::StatusCode::UNAUTHENTICATED, "wrong join token; the coordinator's is in DATA/join-token"});
  call_->met();
  if (!watcher_.admitted(this))
    return Finish({grpc::StatusCode::UNAVAILABLE, "too many transfers at once; try again"});
  run_([this] { open(); });
}

void BlobStream::open() {
  const auto digest = wire::digest_from(request_.digest(), "digest");
  if (!digest) return Finish(to_status(digest.error()));
  digest_ = *digest;
  if (const auto right = blobs_.prove(digest_, request_.arrived_wrong()); !right)
    return refuse(right.error());
  const auto size = blobs_.size(digest_);
  if (!size) return refuse(size.error());
  size_ = *size;
  offset_ = request_.offset();
  if (offset_ > size_)
    return Finish({grpc::StatusCode::OUT_OF_RANGE,
                   fmt::format("offset {} is beyond the blob's end, {}", offset_, size_)});
  next();
}

void BlobStream::next() {
  if (offset_ == size_) return Finish(grpc::Status::OK);
  const auto bytes =
      blobs_.read(digest_, offset_, std::min<std::uint64_t>(limits::kBlobChunkBytes, size_ - offset_));
  if (!bytes) return refuse(bytes.error());
  if (bytes->empty()) return Finish({grpc::StatusCode::INTERNAL, "the blob is shorter than its stated size"});
  offset_ += bytes->size();
  coordinator_.blob_sent(bytes->size());
  chunk_.set_data(bytes->data(), bytes->size());
  watcher_.waits(true);
  StartWrite(&chunk_);
}

// Ends the call with an error. If the blob is missing or damaged, the coordinator is informed first and
// pauses the jobs that need the blob. Then Finish() reports the error to the worker, which returns its units.
// Since their job is paused, they are not leased again immediately.
void BlobStream::refuse(const Error& why) {
  if (why.code == Errc::not_found || why.code == Errc::failed_precondition)
    coordinator_.blob_missing(digest_, why);
  Finish(to_status(why));
}

void BlobStream::OnWriteDone(bool ok) {
  watcher_.waits(false);
  if (!ok) return Finish({grpc::StatusCode::CANCELLED, "the worker left"});
  run_([this] { next(); });
}

void BlobStream::OnDone() {
  watcher_.gone();
  delete this;
}

}  // namespace ls::coordinator::rpc
