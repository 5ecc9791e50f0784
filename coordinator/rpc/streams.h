// The gRPC reactors (objects that serve one call each) for the two calls that a worker makes: its stream of
// messages (WorkStream), and its fetches of blobs, the files of scenes (BlobStream).
#pragma once

#include <atomic>
#include <deque>
#include <functional>
#include <memory>

#include "coordinator/rpc/join_guard.h"
#include "coordinator/rpc/listener.h"
#include "coordinator/service/coordinator.h"
#include "core/base/clock.h"
#include "core/base/guarded.h"
#include "proto/farm.grpc.pb.h"
#include "proto/farm.pb.h"

namespace ls::coordinator::rpc {

namespace pb = ::lightshaft::farm::v1;

// One worker's gRPC stream. It passes the worker's messages to the worker's WorkerSession, and messages to
// the worker through a queue of at most kQueuedMessages.
//
// A stream consists of two objects. The Outlet is the WorkerSink through which the coordinator sends; the
// coordinator may keep it after the stream has ended. The WorkStream is gRPC's reactor and deletes itself in
// OnDone. The outlet's lock is never held during calls to the coordinator, so the coordinator may call the
// Outlet while it holds its own locks.
class WorkStream;

class Outlet final : public WorkerSink {
 public:
  explicit Outlet(WorkStream* stream) : state_(stream) {}
  void send(ToWorker message) override;
  void close() override;
  void read_on();  // starts to read the worker's next message; may be called from any thread

 private:
  friend class WorkStream;
  struct State {
    explicit State(WorkStream* s) : stream(s) {}
    void end(const grpc::Status& with);  // ends the stream with this status once the queue is empty
    void pump();  // starts the next write; if nothing is queued and `closing` is set, ends the stream

    WorkStream* stream;  // null after OnDone
    std::deque<pb::ToWorker> queue;
    bool writing = false;   // a write of queue.front() is in progress
    bool closing = false;   // end the stream with `status` once the queue is empty
    bool finished = false;  // Finish was called
    grpc::Status status;
  };
  Guarded<State> state_;
};

class WorkStream final : public grpc::ServerBidiReactor<pb::FromWorker, pb::ToWorker> {
 public:
  // The stream calls `on_gone` last, before it deletes itself. `guard` must outlive the stream. The server
  // disconnects a worker that has not sent its hello by `hello_deadline`.
  WorkStream(Coordinator& coordinator, grpc::CallbackServerContext* context, const JoinGuard& guard,
             std::unique_ptr<Listener::Call> call, TimePoint hello_deadline,
             std::function<void(WorkStream*)> on_gone);

  void begin() { StartRead(&incoming_); }
  // Sends the error to the worker, then ends the stream. `retry`: the worker should try again later.
  void refuse(const Error& error, bool retry);
  void end(const grpc::Status& status);  // ends the stream after the queued messages are sent
  void cut();                            // ends the stream immediately, without sending the queued messages
  bool hello_overdue(TimePoint now) const { return !greeted_ && now >= hello_deadline_; }

  void OnReadDone(bool ok) override;
  void OnWriteDone(bool ok) override;
  void OnCancel() override;
  void OnDone() override;

 private:
  friend class Outlet;
  void greet(FromWorker message);

  Coordinator& coordinator_;
  grpc::CallbackServerContext* context_;
  const JoinGuard& guard_;
  const std::unique_ptr<Listener::Call> call_;
  const TimePoint hello_deadline_;
  const std::function<void(WorkStream*)> on_gone_;
  std::shared_ptr<Outlet> outlet_;
  // Used in OnReadDone() and OnDone() only, which gRPC never runs at the same time
  std::unique_ptr<WorkerSession> session_;
  std::atomic<bool> greeted_{false};
  pb::FromWorker incoming_;
};

using RunOn = std::function<void(std::function<void()>)>;  // runs the function that it gets on another thread

// One FetchBlob call: sends a blob to a worker in chunks, as fast as the worker takes them. The blob is read
// on separate threads: the coordinator may first have to fetch it from another machine, which can take
// minutes, and gRPC's few threads must stay free for the messages of workers.
class BlobStream final : public grpc::ServerWriteReactor<pb::BlobChunk> {
 public:
  // How the server follows the transfer. It may end it with cut(), until `gone` was called.
  struct Watcher {
    std::function<bool(BlobStream*)> admitted;  // false: there is no place for it
    std::function<void(bool)> waits;            // true: for its worker to take a chunk; false: no longer
    std::function<void()> gone;                 // called last, before the stream deletes itself
  };
  BlobStream(Coordinator& coordinator, grpc::CallbackServerContext* context,
             const pb::FetchBlobRequest& request, const JoinCheck& may_join,
             std::unique_ptr<Listener::Call> call, RunOn run, Watcher watcher);
  // Starts the first write, or ends the call with an error.
  void begin(const JoinGuard& guard);
  void cut() { context_->TryCancel(); }

  void OnWriteDone(bool ok) override;
  void OnDone() override;

 private:
  void open();
  void next();
  void refuse(const Error& why);

  Coordinator& coordinator_;
  grpc::CallbackServerContext* context_;
  BlobStore& blobs_;
  const pb::FetchBlobRequest& request_;  // owned by gRPC; exists until OnDone
  const JoinCheck& may_join_;
  const std::unique_ptr<Listener::Call> call_;
  const RunOn run_;
  const Watcher watcher_;
  Digest digest_;
  std::uint64_t offset_ = 0, size_ = 0;
  pb::BlobChunk chunk_;
};

}  // namespace ls::coordinator::rpc
