// Keeps blobs as objects PREFIX/ab/<64 hex digits> in an S3-compatible store, so that they outlive this
// machine and other machines can read them. A local folder holds uploads until they are complete and
// verified. It also keeps copies of the blobs that were read, up to S3Address::copies_bytes. An object is
// fetched only if there is no local copy of it; the digest of the fetched bytes is checked. A blob exists if
// the S3 store has an undamaged object for it.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <list>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <vector>

#include "coordinator/store/blobs/disk_blobs.h"
#include "coordinator/store/blobs/s3_link.h"
#include "core/base/digest.h"
#include "core/base/guarded.h"

namespace ls::coordinator {

// Remembers the local copies of a remote store's blobs and the time of their last use, and decides which
// copies must be removed to make room for newer ones. It removes nothing itself.
class LocalCopies {
 public:
  // All copies together may have at most `most` bytes; 0: no limit.
  explicit LocalCopies(std::uint64_t most) : most_(most) {}

  // Records that the local copy of this blob, which has this many bytes, has just been read or written.
  // Returns the copies that the caller must remove to stay within the limit; this copy is never among them.
  std::vector<Digest> used(const Digest& digest, std::uint64_t bytes);
  void gone(const Digest& digest);
  std::uint64_t bytes() const { return bytes_; }

 private:
  struct Copy {
    Digest digest;
    std::uint64_t bytes;
  };

  const std::uint64_t most_;
  std::list<Copy> order_;  // the most recently used at the end
  std::map<Digest, std::list<Copy>::iterator> where_;
  std::uint64_t bytes_ = 0;
};

class S3Blobs final : public BlobStore {
 public:
  // Lists the objects of the store first, so that a wrong key, bucket or address is reported when the
  // coordinator starts. `folder` is the local folder.
  static Result<std::unique_ptr<S3Blobs>> open(const S3Options& options, std::filesystem::path folder);

  bool has(const Digest& digest) const override { return find(digest).value_or(false); }
  Result<bool> find(const Digest& digest) const override;
  Result<std::vector<Digest>> missing(std::span<const Digest> digests) const override;
  Result<void> answers() const override { return link_.answers(); }
  // Verifies the local copy, if there is one; a damaged copy is moved aside. Then checks that the S3 store
  // has the blob: a local file that could not be sent does not count. Bytes in the S3 store are verified when
  // they are fetched.
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
  Result<void> send(const Digest& digest);  // copies the blob from the local folder to the S3 store
  // Copies the blob from the S3 store to the local folder. If it is being fetched already, waits for that
  // fetch.
  Result<void> fetch(const Digest& digest) const;
  Result<void> fetch_now(const Digest& digest) const;
  bool known(const Digest& digest) const;  // true if the S3 store is known to have the blob
  void note(const Digest& digest) const;
  void note_lost(const Digest& digest) const;
  Error note_damaged(const Digest& digest, const Error& why) const;
  // Records that the local copy of a blob was used, and removes other copies if there are too many. A local
  // blob that the S3 store lacks is not a copy and is never removed.
  void note_copy(const Digest& digest) const;

  S3Link link_;
  std::unique_ptr<DiskBlobs> local_;
  mutable Guarded<LocalCopies> copies_;
  mutable std::mutex mutex_;
  mutable std::set<Digest> there_;  // blobs known to be in the S3 store
  // Blobs whose object in the S3 store is damaged, with the ETag of that object. Such a blob counts as
  // missing until the ETag changes.
  mutable std::map<Digest, std::string> damaged_;
  struct Flight {
    std::condition_variable landed;
    std::optional<Result<void>> outcome;
  };
  mutable std::map<Digest, std::shared_ptr<Flight>> coming_;
};

}  // namespace ls::coordinator
