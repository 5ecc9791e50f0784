// The worker's content-addressed store of blobs: DIR/ab/abcdef... by SHA-256.
//
// A blob is visible only complete and verified. What an interrupted transfer left (DIR/partial/...) is gone
// on with. A file that no longer has its digest (bad disk, meddling) is found when it is first used by this
// process, thrown away and fetched again. One that arrives wrong is complained of, and tried again: no error
// of a transfer is ever the job's fault. Above the limit, which counts what is on its way too, the least
// recently used go first, never one in use: the file is held by a shared flock while a BlobFile lives, also
// against other workers that use the same folder. Only files of the cache's own names at their own places are
// ever removed; CACHEDIR.TAG tells backups to pass by.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <set>
#include <span>

#include "common/base/error.h"
#include "worker/agent/blob_files.h"
#include "worker/link.h"

namespace ls::worker {

class PartialFile;

class BlobCache final : public BlobFiles {
 public:
  using Sink = std::function<Result<void>(std::span<const std::byte>)>;
  using Fetch =
      std::function<Result<void>(const BlobRequest&, const Sink& sink)>;  // CoordinatorLink::fetch_blob

  // limit_bytes 0: none. Makes the folder.
  static Result<std::unique_ptr<BlobCache>> open(std::filesystem::path folder, std::uint64_t limit_bytes,
                                                 Fetch fetch);

  Result<std::shared_ptr<const BlobFile>> acquire(const BlobRef& blob) override;
  std::vector<Digest> held(std::size_t limit) const override;

 private:
  BlobCache(std::filesystem::path folder, std::uint64_t limit_bytes, Fetch fetch);
  Result<std::shared_ptr<const BlobFile>> open_verified(const Digest& digest);
  // `arrived_wrong`: of the blob, before.
  Result<void> download(const BlobRef& blob, bool arrived_wrong);
  Result<void> receive(const BlobRef& blob, bool arrived_wrong, PartialFile& partial);
  // Until `bytes` fit beside everything but the file `but`.
  Result<void> make_room(std::uint64_t bytes, const std::filesystem::path& but);

  const std::filesystem::path folder_;
  const std::uint64_t limit_;
  const Fetch fetch_;
  std::mutex mutex_;           // one acquire at a time
  std::set<Digest> verified_;  // by this process
};

}  // namespace ls::worker
