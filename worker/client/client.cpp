#include "worker/client/client.h"

#include <fmt/format.h>
#include <grpcpp/grpcpp.h>

#include <mutex>
#include <set>

#include "common/protocol/limits.h"
#include "proto/convert.h"
#include "worker/client/coordinator_stream.h"

namespace ls::worker {
namespace pb = ::lightshaft::farm::v1;
namespace {

// Time that one attempt to connect may take, including the TLS handshake. With a shorter limit, handshakes
// over a slow line, or with a coordinator that many workers join at once, would be cut off at every attempt.
// A longer one would delay the next attempt after a broken connection.
constexpr int kConnectMs = 10'000;
constexpr Duration kCloseLimit = std::chrono::seconds(2);

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
  // The agent has its own back-off between attempts to connect; the back-off of gRPC must not be longer.
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

  Result<void> fetch_blob(const BlobRequest& wanted,
                          const std::function<Result<void>(std::span<const std::byte>)>& sink) override {
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
