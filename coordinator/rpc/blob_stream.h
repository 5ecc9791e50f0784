// One FetchBlob call: sends a blob to a worker in chunks, as fast as the worker takes them. The blob is read
// on separate threads: the coordinator may first have to fetch it from another machine, which can take
// minutes, and gRPC's few threads must stay free for the messages of workers.
#pragma once

#include <functional>

#include "coordinator/rpc/join_guard.h"
#include "coordinator/service/coordinator.h"
#include "proto/farm.grpc.pb.h"
#include "proto/farm.pb.h"

namespace ls::coordinator::rpc {

using RunOn = std::function<void(std::function<void()>)>;  // runs the function on another thread

class BlobStream final : public grpc::ServerWriteReactor<lightshaft::farm::v1::BlobChunk> {
 public:
  BlobStream(Coordinator& coordinator, const lightshaft::farm::v1::FetchBlobRequest& request,
             const JoinCheck& may_join, RunOn run, std::function<void()> on_gone);
  // Starts the first write, or ends the call with an error.
  void begin(const JoinGuard& guard, const std::string& address);

  void OnWriteDone(bool ok) override;
  void OnDone() override;

 private:
  void open();
  void next();
  void refuse(const Error& why);

  Coordinator& coordinator_;
  BlobStore& blobs_;
  const lightshaft::farm::v1::FetchBlobRequest& request_;  // exists as long as the call
  const JoinCheck& may_join_;
  const RunOn run_;
  const std::function<void()> on_gone_;
  Digest digest_;
  std::uint64_t offset_ = 0, size_ = 0;
  lightshaft::farm::v1::BlobChunk chunk_;
};

}  // namespace ls::coordinator::rpc
