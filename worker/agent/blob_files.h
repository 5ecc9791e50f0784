// Provides the files of a job's blobs: a cache that fetches missing ones (worker/cache), or files that are
// already local (`lightshaft render`).
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <vector>

#include "common/base/error.h"
#include "common/protocol/messages.h"

namespace ls::worker {

// A complete, verified blob on this machine. The file is kept while the object lives.
class BlobFile {
 public:
  virtual ~BlobFile() = default;
  virtual const std::filesystem::path& path() const = 0;
};

class BlobFiles {
 public:
  virtual ~BlobFiles() = default;
  // Blocks while it fetches. unavailable: the transfer was interrupted; retry later (received bytes are
  // kept). resource_exhausted, internal: a problem of this machine or its coordinator (a full disk, the cache
  // limit, a blob missing at the coordinator) that is not the job's fault and may pass. Other errors are
  // final: not_found if the file has no source.
  virtual Result<std::shared_ptr<const BlobFile>> acquire(const BlobRef& blob) = 0;
  // For the hello: at most `limit` blobs, most recently used first.
  virtual std::vector<Digest> held(std::size_t limit) const = 0;
};

// Files that are already on this machine, by digest.
class LocalFiles final : public BlobFiles {
 public:
  explicit LocalFiles(std::map<Digest, std::filesystem::path> files) : files_(std::move(files)) {}
  Result<std::shared_ptr<const BlobFile>> acquire(const BlobRef& blob) override;
  std::vector<Digest> held(std::size_t limit) const override;

 private:
  const std::map<Digest, std::filesystem::path> files_;
};

}  // namespace ls::worker
