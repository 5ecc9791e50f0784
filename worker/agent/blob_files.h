// Provides the files of a job's blobs (its scene and assets). BlobFiles has two implementations: a cache that
// fetches missing blobs from the coordinator (worker/cache), and `lightshaft render`, whose files are local
// already (cli/local).
#pragma once

#include <filesystem>
#include <memory>
#include <vector>

#include "common/base/error.h"
#include "common/protocol/messages.h"

namespace ls::worker {

// A complete, verified blob on this machine. The file is not removed while the object lives.
class BlobFile {
 public:
  virtual ~BlobFile() = default;
  virtual const std::filesystem::path& path() const = 0;
};

class BlobFiles {
 public:
  virtual ~BlobFiles() = default;
  // Returns the blob's file, and blocks while it is fetched. unavailable: the transfer was interrupted; the
  // bytes received are kept, and the caller should try again later. resource_exhausted, internal: this
  // machine or its coordinator has a problem (a full disk, the cache limit, a blob missing at the
  // coordinator) that is not the job's fault and may pass. Other errors are final: for example not_found, if
  // no source has the blob.
  virtual Result<std::shared_ptr<const BlobFile>> acquire(const BlobRef& blob) = 0;
  // Returns the digests of the blobs on this machine, at most `limit`, most recently used first. The worker's
  // hello sends this list to the coordinator.
  virtual std::vector<Digest> held(std::size_t limit) const = 0;
};

}  // namespace ls::worker
