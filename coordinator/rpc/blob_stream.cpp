#include "coordinator/rpc/blob_stream.h"

#include <fmt/format.h>

#include <algorithm>

#include "common/base/secret.h"
#include "common/protocol/limits.h"
#include "coordinator/rpc/convert.h"
#include "proto/convert.h"

namespace ls::coordinator::rpc {

BlobStream::BlobStream(BlobStore& blobs, const lightshaft::farm::v1::FetchBlobRequest& request,
                       const std::string& join_token, std::function<void()> on_gone)
    : blobs_(blobs), request_(request), join_token_(join_token), on_gone_(std::move(on_gone)) {}

void BlobStream::begin() {
  if (!join_token_.empty() && !equal_secret(request_.join_token(), join_token_))
    return Finish(
        {grpc::StatusCode::UNAUTHENTICATED, "wrong join token; the coordinator's is in DATA/join-token"});
  const auto digest = wire::digest_from(request_.digest(), "digest");
  if (!digest) return Finish(to_status(digest.error()));
  digest_ = *digest;
  const auto size = blobs_.size(digest_);
  if (!size) return Finish(to_status(size.error()));
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
  if (!bytes) return Finish(to_status(bytes.error()));
  if (bytes->empty()) return Finish({grpc::StatusCode::INTERNAL, "the blob is shorter than its stated size"});
  offset_ += bytes->size();
  chunk_.set_data(bytes->data(), bytes->size());
  StartWrite(&chunk_);
}

void BlobStream::OnWriteDone(bool ok) {
  if (!ok) return Finish({grpc::StatusCode::CANCELLED, "the worker left"});
  next();
}

void BlobStream::OnDone() {
  on_gone_();
  delete this;
}

}  // namespace ls::coordinator::rpc
