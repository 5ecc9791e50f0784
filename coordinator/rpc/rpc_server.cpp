#include "coordinator/rpc/rpc_server.h"

#include <fmt/format.h>
#include <grpcpp/grpcpp.h>
#include <sys/resource.h>
#include <unistd.h>

#include <map>
#include <mutex>
#include <set>
#include <thread>

#include "coordinator/base/work_queue.h"
#include "coordinator/rpc/connection_table.h"
#include "coordinator/rpc/fetch_table.h"
#include "coordinator/rpc/listener.h"
#include "coordinator/rpc/port_watch.h"
#include "coordinator/rpc/streams.h"
#include "core/base/guarded.h"
#include "core/base/log.h"
#include "util/protocol/limits.h"

namespace ls::coordinator {

using namespace rpc;
namespace pb = ::lightshaft::farm::v1;

namespace {

// At most this many streams of workers are open, those that wait for their hello included
constexpr int kWorkStreams = 17'408;
// Calls in progress on one connection: a worker's stream, and its transfers of blobs
constexpr int kCallsOfConnection = 64;
// Bytes that gRPC may use for connections and calls. Beyond it, it ends some of them.
constexpr std::size_t kGrpcMemory = std::size_t{1} << 30;
// Number of threads that read blobs for transfers; many, because most of them may be waiting for blobs that
// the coordinator must first fetch from another machine
constexpr int kReadThreads = 64;
// Number of threads that pass sockets to gRPC. It may read and parse what has come on a connection before it
// returns, so the thread of the Listener, which closes connections that send too much, must not do that.
constexpr int kTakeThreads = 4;
// A worker can send at most this many bytes that the coordinator has not read yet; then its sending pauses.
constexpr int kUnreadBytes = 64 << 10;
constexpr int kHelloSeconds = 5;  // a worker must send its hello within this time after opening its stream
constexpr int kHandshakeMs = 10'000;
// Clients that ping at shorter intervals are disconnected (GOAWAY too_many_pings).
constexpr int kPingsNotOftenerMs = 5'000;

// With fewer connections than this the log says at the start how many there are
constexpr std::size_t kConnectionsOfALargeFarm = 4096;

const grpc::Status kTooManyCalls(grpc::StatusCode::RESOURCE_EXHAUSTED,
                                 "too many calls on this connection before a hello");

// Returns how many files this process may have open.
std::uint64_t file_limit() {
  rlimit limit{};
  return ::getrlimit(RLIMIT_NOFILE, &limit) == 0 ? limit.rlim_cur : 1024;
}

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
    using Refused = Refusal<grpc::ServerBidiReactor<pb::FromWorker, pb::ToWorker>>;
    auto call = listener->call(context->peer());
    if (!call) return new Refused(kTooManyCalls);
    const std::lock_guard lock(mutex);
    if (stopping || streams.size() >= kWorkStreams)
      return new Refused(
          stopping ? grpc::Status(grpc::StatusCode::UNAVAILABLE, "the coordinator is going down")
                   : grpc::Status(grpc::StatusCode::RESOURCE_EXHAUSTED, "too many workers are connected"));
    const TimePoint deadline = clock.now() + std::chrono::seconds(kHelloSeconds);
    auto* stream =
        new WorkStream(coordinator, context, guard, std::move(call), deadline, [this](WorkStream* gone) {
          const std::lock_guard inner(mutex);
          streams.erase(gone);
        });
    streams.insert(stream);
    stream->begin();
    return stream;
  }

  grpc::ServerWriteReactor<pb::BlobChunk>* FetchBlob(grpc::CallbackServerContext* context,
                                                     const pb::FetchBlobRequest* request) override {
    auto call = listener->call(context->peer());
    if (!call) return new Refusal<grpc::ServerWriteReactor<pb::BlobChunk>>(kTooManyCalls);
    const FetchTable::Id id = ++last_fetch;
    const ConnectionTable::Guest guest = call->guest();
    auto* stream = new BlobStream(coordinator, context, *request, may_join, std::move(call),
                                  [this](std::function<void()> read) { reads.push(std::move(read)); },
                                  {[this, id, guest](BlobStream* admitted) {
                                     return fetches.lock()->admit(id, guest, admitted, clock.now());
                                   },
                                   [this, id](bool waits) {
                                     const auto state = fetches.lock();
                                     waits ? state->table.waits(id, clock.now()) : state->table.taken(id);
                                   },
                                   [this, id] { fetches.lock()->gone(id); }});
    stream->begin(guard);
    return stream;
  }

  // Disconnects workers that opened a stream but sent no hello in time, and those that do not read the blobs
  // that they asked for.
  void sweep(const std::stop_token& token) {
    every(std::chrono::seconds(1), token, [this] {
      {
        const std::lock_guard lock(mutex);
        for (WorkStream* stream : streams)
          if (stream->hello_overdue(clock.now())) stream->cut();
      }
      const auto state = fetches.lock();
      for (const FetchTable::Id id : state->table.stalled(clock.now())) state->streams.at(id)->cut();
    });
  }

  // Looks whether the port answers; `on_dead` is called once if it is dead.
  void watch(const std::stop_token& token, const std::function<void()>& on_dead) {
    every(kPortLook, token, [&] {
      const auto answered = listener->answers(kPortTimeLimit);
      const auto state = port.lock();
      const bool was_dead = state->dead();
      state->looked(answered);
      if (const std::string trouble = state->trouble(); !trouble.empty()) log_error("", trouble);
      if (state->dead() && !was_dead && on_dead) on_dead();
    });
  }

  void take_sockets(const std::stop_token& token) {
    while (!token.stop_requested())
      for (const int socket : sockets.pop(1, token)) {
        grpc::experimental::ExternalConnectionAcceptor::NewConnectionParameters connection;
        connection.fd = socket;
        acceptor->HandleNewConnection(&connection);
      }
  }

  struct Fetches {
    bool admit(FetchTable::Id id, const ConnectionTable::Guest& guest, BlobStream* stream, TimePoint now) {
      const auto admission = table.arrive(id, guest.peer, guest.group, now);
      if (admission.ended) streams.at(*admission.ended)->cut();
      if (admission.taken) streams.emplace(id, stream);
      return admission.taken;
    }
    void gone(FetchTable::Id id) {
      table.gone(id);
      streams.erase(id);
    }
    FetchTable table;
    std::map<FetchTable::Id, BlobStream*> streams;
  };

  Coordinator& coordinator;
  const JoinCheck may_join;
  const JoinGuard guard;
  const SystemClock clock;
  std::unique_ptr<Listener> listener;
  std::unique_ptr<grpc::experimental::ExternalConnectionAcceptor> acceptor;
  std::unique_ptr<grpc::Server> server;
  WorkQueue<int> sockets;  // accepted, to be passed to gRPC
  std::vector<std::jthread> takers;
  std::mutex mutex;
  std::set<WorkStream*> streams;  // guarded by mutex
  bool stopping = false;          // guarded by mutex
  std::atomic<FetchTable::Id> last_fetch{0};
  Guarded<Fetches> fetches;
  Guarded<PortWatch> port;
  // Reads of blobs that wait for a thread. A read may depend on another machine, so it must not block one of
  // gRPC's few threads, which must stay free for the messages of workers.
  WorkQueue<std::function<void()>> reads;
  std::vector<std::jthread> readers;  // stopped after the last stream
  std::jthread sweeper, watcher;
};

GrpcServer::GrpcServer(Coordinator& coordinator, JoinCheck may_join, JoinGuard guard)
    : impl_(std::make_unique<Impl>(coordinator, std::move(may_join), std::move(guard))) {}

GrpcServer::~GrpcServer() { stop(); }

Result<int> GrpcServer::start(const std::string& address, const std::optional<Tls>& tls,
                              const std::function<void()>& on_dead) {
  const std::size_t connections = connections_for(file_limit());
  auto listener = Listener::open(address, ConnectionTable::limits_for(connections));
  if (!listener) return tl::unexpected(listener.error());
  if (connections < kConnectionsOfALargeFarm)
    log_info("",
             fmt::format("at most {} workers can connect: this process may have {} files open (ulimit -n)",
                         connections, file_limit()));
  grpc::ServerBuilder builder;
  impl_->acceptor = builder.experimental().AddExternalConnectionAcceptor(
      grpc::ServerBuilder::experimental_type::ExternalConnectionType::FROM_FD, credentials(tls));
  grpc::ResourceQuota memory("workers");
  memory.Resize(kGrpcMemory);
  builder.SetResourceQuota(memory);
  builder.RegisterService(impl_.get());
  builder.SetMaxReceiveMessageSize(static_cast<int>(limits::kMessageBytes));
  builder.SetMaxSendMessageSize(static_cast<int>(limits::kMessageBytes));
  builder.AddChannelArgument(GRPC_ARG_MAX_CONCURRENT_STREAMS, kCallsOfConnection);
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
  if (!impl_->server) return fail(Errc::internal, "gRPC cannot start its server for workers");
  impl_->listener = std::move(*listener);
  for (int i = 0; i < kTakeThreads; ++i)
    impl_->takers.emplace_back([this](const std::stop_token& token) { impl_->take_sockets(token); });
  impl_->listener->start([this](int socket) { impl_->sockets.push(socket); });
  for (int i = 0; i < kReadThreads; ++i)
    impl_->readers.emplace_back([&reads = impl_->reads](const std::stop_token& token) {
      while (!token.stop_requested())
        for (auto& read : reads.pop(1, token)) read();
    });
  impl_->sweeper = std::jthread([this](std::stop_token token) { impl_->sweep(token); });
  impl_->watcher =
      std::jthread([this, on_dead](const std::stop_token& token) { impl_->watch(token, on_dead); });
  return impl_->listener->port();
}

std::string GrpcServer::trouble() const { return impl_->port.lock()->trouble(); }

void GrpcServer::stop() {
  if (!impl_->server) return;
  impl_->watcher.request_stop();
  if (impl_->watcher.joinable()) impl_->watcher.join();
  impl_->listener->stop();
  for (auto& taker : impl_->takers) taker.request_stop();
  impl_->takers.clear();
  while (impl_->sockets.size() > 0)
    for (const int socket : impl_->sockets.pop(1, {})) ::close(socket);
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
