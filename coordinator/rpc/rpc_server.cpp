#include "coordinator/rpc/rpc_server.h"

#include <fmt/format.h>
#include <grpcpp/grpcpp.h>

#include <mutex>
#include <set>
#include <thread>

#include "common/base/log.h"
#include "common/protocol/limits.h"
#include "coordinator/base/work_queue.h"
#include "coordinator/rpc/streams.h"

namespace ls::coordinator {

using rpc::BlobStream;
using rpc::WorkStream;
namespace pb = ::lightshaft::farm::v1;

namespace {

// At most this many workers are connected at the same time; equals limits::kMaxWorkers (base/limits.h).
constexpr int kWorkStreams = 16'384;
// At most this many blob transfers are in progress; further ones are rejected, and workers retry them
constexpr int kFetches = 512;
// Number of threads that read blobs for these transfers; many, because most of them may be waiting for blobs
// that the coordinator must first fetch from another machine
constexpr int kReadThreads = 64;
// A worker can send at most this many bytes that the coordinator has not read yet; then its sending pauses.
constexpr int kUnreadBytes = 64 << 10;
constexpr int kHelloSeconds = 20;  // a worker must send its hello within this time after opening its stream
constexpr int kHandshakeMs = 10'000;
// Clients that ping at shorter intervals are disconnected (GOAWAY too_many_pings).
constexpr int kPingsNotOftenerMs = 5'000;

// A gRPC reactor (the object that serves one call) that only ends the call with the error `status`.
template <class Reactor>
class Refusal final : public Reactor {
 public:
  explicit Refusal(const grpc::Status& status) { this->Finish(status); }
  void OnDone() override { delete this; }
};

std::shared_ptr<grpc::ServerCredentials> credentials(const std::optional<GrpcServer::Tls>& tls) {
  if (!tls) return grpc::InsecureServerCredentials();
  grpc::SslServerCredentialsOptions options(GRPC_SSL_REQUEST_AND_REQUIRE_CLIENT_CERTIFICATE_AND_VERIFY);
  options.pem_root_certs = tls->ca;
  options.pem_key_cert_pairs.push_back({tls->key, tls->cert});
  return grpc::SslServerCredentials(options);
}
}  // namespace

struct GrpcServer::Impl final : pb::Farm::CallbackService {
  Impl(Coordinator& c, JoinCheck check, JoinGuard g)
      : coordinator(c), may_join(std::move(check)), guard(std::move(g)) {}

  grpc::ServerBidiReactor<pb::FromWorker, pb::ToWorker>* Work(grpc::CallbackServerContext* context) override {
    const std::lock_guard lock(mutex);
    if (stopping || streams.size() >= kWorkStreams)
      return new Refusal<grpc::ServerBidiReactor<pb::FromWorker, pb::ToWorker>>(
          stopping ? grpc::Status(grpc::StatusCode::UNAVAILABLE, "the coordinator is going down")
                   : grpc::Status(grpc::StatusCode::RESOURCE_EXHAUSTED, "too many workers are connected"));
    const TimePoint deadline = clock.now() + std::chrono::seconds(kHelloSeconds);
    auto* stream = new WorkStream(coordinator, context, guard, deadline, [this](WorkStream* gone) {
      const std::lock_guard inner(mutex);
      streams.erase(gone);
    });
    streams.insert(stream);
    stream->begin();
    return stream;
  }

  grpc::ServerWriteReactor<pb::BlobChunk>* FetchBlob(grpc::CallbackServerContext* context,
                                                     const pb::FetchBlobRequest* request) override {
    if (++fetches > kFetches) {
      --fetches;
      return new Refusal<grpc::ServerWriteReactor<pb::BlobChunk>>(
          grpc::Status(grpc::StatusCode::UNAVAILABLE, "too many transfers at once; try again"));
    }
    auto* stream = new BlobStream(
        coordinator, *request, may_join, [this](std::function<void()> read) { reads.push(std::move(read)); },
        [this] { --fetches; });
    stream->begin(guard, address_of_peer(context->peer()));
    return stream;
  }

  // Disconnects workers that opened a stream but sent no hello in time.
  void sweep(const std::stop_token& token) {
    every(std::chrono::seconds(1), token, [this] {
      const std::lock_guard lock(mutex);
      for (WorkStream* stream : streams)
        if (stream->hello_overdue(clock.now())) stream->cut();
    });
  }

  Coordinator& coordinator;
  const JoinCheck may_join;
  const JoinGuard guard;
  const SystemClock clock;
  std::unique_ptr<grpc::Server> server;
  std::mutex mutex;
  std::set<WorkStream*> streams;  // guarded by mutex
  bool stopping = false;          // guarded by mutex
  std::atomic<int> fetches{0};
  // Reads of blobs that wait for a thread. A read may depend on another machine, so it must not block one of
  // gRPC's few threads, which must stay free for the messages of workers.
  WorkQueue<std::function<void()>> reads;
  std::vector<std::jthread> readers;  // stopped after the last stream
  std::jthread sweeper;
};

GrpcServer::GrpcServer(Coordinator& coordinator, JoinCheck may_join, JoinGuard guard)
    : impl_(std::make_unique<Impl>(coordinator, std::move(may_join), std::move(guard))) {}

GrpcServer::~GrpcServer() { stop(); }

Result<int> GrpcServer::start(const std::string& address, const std::optional<Tls>& tls) {
  grpc::ServerBuilder builder;
  int port = 0;
  builder.AddListeningPort(address, credentials(tls), &port);
  builder.RegisterService(impl_.get());
  builder.SetMaxReceiveMessageSize(static_cast<int>(limits::kMessageBytes));
  builder.SetMaxSendMessageSize(static_cast<int>(limits::kMessageBytes));
  builder.AddChannelArgument(GRPC_ARG_ALLOW_REUSEPORT, 0);
  builder.AddChannelArgument(GRPC_ARG_SERVER_HANDSHAKE_TIMEOUT_MS, kHandshakeMs);
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIME_MS, limits::kKeepaliveMs);
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, limits::kKeepaliveTimeoutMs);
  builder.AddChannelArgument(GRPC_ARG_HTTP2_MIN_RECV_PING_INTERVAL_WITHOUT_DATA_MS, kPingsNotOftenerMs);
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_PERMIT_WITHOUT_CALLS, 1);
  builder.AddChannelArgument(GRPC_ARG_HTTP2_MAX_PINGS_WITHOUT_DATA, 0);
  builder.AddChannelArgument(GRPC_ARG_MAX_METADATA_SIZE, 16 << 10);
  // Limits the bytes that gRPC receives on a stream before the coordinator reads them. The default lets this
  // limit grow to megabytes per worker.
  builder.AddChannelArgument(GRPC_ARG_HTTP2_BDP_PROBE, 0);
  builder.AddChannelArgument(GRPC_ARG_HTTP2_STREAM_LOOKAHEAD_BYTES, kUnreadBytes);
  impl_->server = builder.BuildAndStart();
  if (!impl_->server || port == 0) {
    impl_->server.reset();
    return fail(
        Errc::unavailable,
        fmt::format(
            "cannot listen for workers on {}: the port is taken (another coordinator?) or the address is "
            "not this machine's; choose another with --grpc",
            address));
  }
  for (int i = 0; i < kReadThreads; ++i)
    impl_->readers.emplace_back([&reads = impl_->reads](const std::stop_token& token) {
      while (!token.stop_requested())
        for (auto& read : reads.pop(1, token)) read();
    });
  impl_->sweeper = std::jthread([this](std::stop_token token) { impl_->sweep(token); });
  return port;
}

void GrpcServer::stop() {
  if (!impl_->server) return;
  {
    const std::lock_guard lock(impl_->mutex);
    impl_->stopping = true;
    for (WorkStream* stream : impl_->streams)
      stream->end(grpc::Status(grpc::StatusCode::UNAVAILABLE, "the coordinator is going down"));
  }
  impl_->sweeper.request_stop();
  // Streams and calls that have not ended after 2 s are cut off.
  impl_->server->Shutdown(std::chrono::system_clock::now() + std::chrono::seconds(2));
  impl_->server->Wait();
  for (auto& reader : impl_->readers) reader.request_stop();
  impl_->readers.clear();
  impl_->server.reset();
}

}  // namespace ls::coordinator
