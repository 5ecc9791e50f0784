// Blobs in an S3-compatible store, so that they outlive this machine and other machines can read them:
// PREFIX/ab/<64 hex digits>. A local folder holds uploads until they are complete and verified, and keeps
// copies of blobs read (up to S3Address::copies_bytes): each object is fetched once, and its digest is
// checked. A blob exists when the store has it, undamaged.
#pragma once

#include <condition_variable>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>

#include "coordinator/store/blobs/disk_blobs.h"
#include "coordinator/store/blobs/local_copies.h"
#include "coordinator/store/blobs/s3_link.h"

namespace ls::coordinator {

class S3Blobs final : public BlobStore {
 public:
  // Lists the store first, so that wrong keys, bucket or address are reported at the start.
  static Result<std::unique_ptr<S3Blobs>> open(const S3Options& options, std::filesystem::path folder);

  bool has(const Digest& digest) const override { return find(digest).value_or(false); }
  Result<bool> find(const Digest& digest) const override;
  Result<void> answers() const override { return link_.answers(); }
  // Verifies the local copy, which is fetched again if it is damaged; a blob without a copy is verified when
  // fetched.
  Result<void> prove(const Digest& digest, bool again = false) const override;
  Result<std::uint64_t> size(const Digest& digest) const override;
  Result<std::vector<std::byte>> read(const Digest& digest, std::uint64_t offset,
                                      std::uint64_t length) const override;
  Result<void> put(const Digest& digest, std::span<const std::byte> bytes) override;
  Result<std::unique_ptr<Upload>> begin_upload(const Digest& digest) override;
  std::uint64_t received(const Digest& digest) const override { return local_->received(digest); }
  Result<std::unique_ptr<Upload>> resume_upload(const Digest& digest, std::uint64_t offset) override;
  Result<std::vector<Digest>> list(bool unfinished) const override;
  Result<void> remove(const Digest& digest) override;
  void remove_unfinished(const Digest& digest) override { local_->remove_unfinished(digest); }

 private:
  class Passed;
  S3Blobs(const S3Options& options, std::unique_ptr<DiskBlobs> local)
      : link_(options), local_(std::move(local)), copies_(options.address.copies_bytes) {}
  Result<void> send(const Digest& digest);  // from the folder to the store
  // From the store to the folder. Requests for a blob that is being fetched wait for that fetch.
  Result<void> fetch(const Digest& digest) const;
  Result<void> fetch_now(const Digest& digest) const;
  void note(const Digest& digest) const;
  void note_lost(const Digest& digest) const;
  Error note_damaged(const Digest& digest, const Error& why) const;
  // Records the use of a copy and may remove others. A local blob that is not in the store is no copy, and
  // stays.
  void note_copy(const Digest& digest) const;

  S3Link link_;
  std::unique_ptr<DiskBlobs> local_;
  mutable LocalCopies copies_;
  mutable std::mutex mutex_;
  mutable std::set<Digest> there_;  // known to be in the store
  // Damaged in the store, with the object's ETag: the blob counts as missing until that changes.
  mutable std::map<Digest, std::string> damaged_;
  struct Flight {
    std::condition_variable landed;
    std::optional<Result<void>> outcome;
  };
  mutable std::map<Digest, std::shared_ptr<Flight>> coming_;
};

}  // namespace ls::coordinator
