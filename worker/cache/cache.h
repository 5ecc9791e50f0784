// The worker's store of blobs, the files of jobs: each is a file DIR/ab/abcdef... named after its SHA-256.
//
// A blob gets this name only when it is complete and verified. Transfers are written to DIR/partial/... and
// resumed if they are interrupted. A file that no longer has its digest (bad disk, manipulation) is detected
// at its first use by this process, removed and fetched again. A blob that arrives with a wrong digest is
// reported to the coordinator and fetched again; no transfer error is ever counted as the job's fault. When
// blobs and transfers in progress exceed the size limit, the least recently used blobs are removed, but never
// one in use: a BlobFile holds a shared flock on its file, which also protects it from other workers that use
// the same folder. A file in the folder is removed only if it has a name and a place that the cache gives to
// its files; CACHEDIR.TAG makes backups skip the folder.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <set>
#include <span>

#include "core/base/error.h"
#include "worker/agent/link.h"

namespace ls::worker {

class PartialFile;

class BlobCache final : public BlobFiles {
 public:
  // Fetches the bytes of a blob; the same as CoordinatorLink::fetch_blob
  using Fetch = std::function<Result<void>(const BlobRequest&, const BlobSink&)>;

  // Opens the cache in `folder`, which is created if it is missing. The cache keeps at most `limit_bytes`
  // bytes; 0: no limit. It calls `fetch` to get blobs that it does not have.
  static Result<std::unique_ptr<BlobCache>> open(std::filesystem::path folder, std::uint64_t limit_bytes,
                                                 Fetch fetch);

  Result<std::shared_ptr<const BlobFile>> acquire(const BlobRef& blob,
                                                  const std::atomic<bool>& stop = kNeverStop) override;
  std::vector<Digest> held(std::size_t limit) const override;

 private:
  BlobCache(std::filesystem::path folder, std::uint64_t limit_bytes, Fetch fetch);
  Result<std::shared_ptr<const BlobFile>> open_verified(const Digest& digest);
  // Fetches a blob. `arrived_wrong`: an earlier transfer of the blob delivered wrong bytes.
  Result<void> download(const BlobRef& blob, bool arrived_wrong, const std::atomic<bool>& stop);
  Result<void> receive(const BlobRef& blob, bool arrived_wrong, const std::atomic<bool>& stop,
                       PartialFile& partial);
  // Removes blobs and the files of abandoned transfers until `bytes` more bytes fit within the limit. Never
  // removes the file `but`.
  Result<void> make_room(std::uint64_t bytes, const std::filesystem::path& but);

  const std::filesystem::path folder_;
  const std::uint64_t limit_;
  const Fetch fetch_;
  std::mutex mutex_;           // held during acquire(), so that its calls run one at a time
  std::set<Digest> verified_;  // blobs whose files this process has verified
};

}  // namespace ls::worker
