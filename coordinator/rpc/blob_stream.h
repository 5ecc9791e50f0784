// One FetchBlob: chunks of a blob, read as the worker takes them.
#pragma once

#include <functional>

#include "coordinator/service.h"
#include "proto/farm.grpc.pb.h"
#include "proto/farm.pb.h"

namespace ls::coordinator::rpc {

class BlobStream final : public grpc::ServerWriteReactor<lightshaft::farm::v1::BlobChunk> {
 public:
  BlobStream(BlobStore& blobs, const lightshaft::farm::v1::FetchBlobRequest& request,
             const std::string& join_token, std::function<void()> on_gone);
  void begin();  // starts the first write, or ends with what is wrong

  void OnWriteDone(bool ok) override;
  void OnDone() override;

 private:
  void next();

  BlobStore& blobs_;
  const lightshaft::farm::v1::FetchBlobRequest& request_;  // lives as long as the call
  const std::string& join_token_;
  const std::function<void()> on_gone_;
  Digest digest_;
  std::uint64_t offset_ = 0, size_ = 0;
  lightshaft::farm::v1::BlobChunk chunk_;
};

}  // namespace ls::coordinator::rpc
