#include "coordinator/rpc/blob_stream.h"

#include <fmt/format.h>

#include <algorithm>

#include "common/protocol/limits.h"
#include "coordinator/rpc/grpc_status.h"
#include "proto/convert.h"

namespace ls::coordinator::rpc {

BlobStream::BlobStream(Coordinator& coordinator, const lightshaft::farm::v1::FetchBlobRequest& request,
                       const JoinCheck& may_join, RunOn run, std::function<void()> on_gone)
    : coordinator_(coordinator),
      blobs_(coordinator.blobs()),
      request_(request),
      may_join_(may_join),
      run_(std::move(run)),
      on_gone_(std::move(on_gone)) {}

// After a write or Finish has been started, no member may be used: OnDone, which deletes this object, may run
// immediately.
void BlobStream::begin(const JoinGuard& guard, const std::string& address) {
  if (const int wait = guard.wait(address, request_.join_token()); wait > 0)
    return Finish({grpc::StatusCode::RESOURCE_EXHAUSTED, too_many_wrong_tokens(wait)});
  const bool right = may_join_(request_.join_token());
  guard.tried(address, request_.join_token(), right);
  if (!right)
    return Finish(
        {grpc::StatusCode::UNAUTHENTICATED, "wrong join token; the coordinator's is in DATA/join-token"});
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
  StartWrite(&chunk_);
}

// Ends the call with an error. A missing blob is reported to the coordinator before Finish, so that the jobs
// that need the blob are paused before the worker returns their units.
void BlobStream::refuse(const Error& why) {
  if (why.code == Errc::not_found || why.code == Errc::failed_precondition)
    coordinator_.blob_missing(digest_, why);
  Finish(to_status(why));
}

void BlobStream::OnWriteDone(bool ok) {
  if (!ok) return Finish({grpc::StatusCode::CANCELLED, "the worker left"});
  run_([this] { next(); });
}

void BlobStream::OnDone() {
  on_gone_();
  delete this;
}

}  // namespace ls::coordinator::rpc
