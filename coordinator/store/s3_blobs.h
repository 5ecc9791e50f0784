// Blobs in an S3-compatible store, so that they outlive this machine and others reach them: PREFIX/ab/<64 hex
// digits>. A folder on this machine takes what arrives until it is whole and proven, and keeps what was read
// (as much as S3Address::copies_bytes says): each object comes once, and its digest is checked. A blob counts
// as there when the store has it, undamaged.
#pragma once

#include <condition_variable>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>

#include "coordinator/store/disk_blobs.h"
#include "coordinator/store/local_copies.h"
#include "coordinator/store/s3_link.h"

namespace ls::coordinator {

class S3Blobs final : public BlobStore {
 public:
  // Asks the store for its list first: what is wrong with keys, bucket or address is told at the start.
  static Result<std::unique_ptr<S3Blobs>> open(const S3Options& options, std::filesystem::path folder);

  bool has(const Digest& digest) const override { return find(digest).value_or(false); }
  Result<bool> find(const Digest& digest) const override;
  Result<void> answers() const override { return link_.answers(); }
  // Of the copy here, which is fetched anew if it is damaged; what is not here is proven when it comes.
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
  // The other way. Who asks while it is on its way waits for the same.
  Result<void> fetch(const Digest& digest) const;
  Result<void> fetch_now(const Digest& digest) const;
  void note(const Digest& digest) const;
  void note_lost(const Digest& digest) const;
  Error note_damaged(const Digest& digest, const Error& why) const;
  // Used just now: others may have to go for it. What lies here and not there is no copy, and stays.
  void note_copy(const Digest& digest) const;

  S3Link link_;
  std::unique_ptr<DiskBlobs> local_;
  mutable LocalCopies copies_;
  mutable std::mutex mutex_;
  mutable std::set<Digest> there_;  // known to be in the store
  // Damaged in the store, and what the store calls the object (ETag): it counts as missing until that
  // changes.
  mutable std::map<Digest, std::string> damaged_;
  struct Flight {
    std::condition_variable landed;
    std::optional<Result<void>> outcome;
  };
  mutable std::map<Digest, std::shared_ptr<Flight>> coming_;
};

}  // namespace ls::coordinator
