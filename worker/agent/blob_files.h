// Where an agent gets the files of a job's blobs: a cache that fetches what it lacks (worker/cache), or files
// that are here already (`lightshaft render`).
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <vector>

#include "common/base/error.h"
#include "common/protocol/messages.h"

namespace ls::worker {

// A blob on this machine, complete and verified. The file stays for as long as the object lives.
class BlobFile {
 public:
  virtual ~BlobFile() = default;
  virtual const std::filesystem::path& path() const = 0;
};

class BlobFiles {
 public:
  virtual ~BlobFiles() = default;
  // Blocks while it fetches. unavailable: the transfer was cut, try again later (what came is kept).
  // resource_exhausted, internal: trouble of this machine or its coordinator (a full disk, the cache limit, a
  // blob that the coordinator lacks) that says nothing about the job and may pass. Other errors are final:
  // not_found of files that can come from nowhere.
  virtual Result<std::shared_ptr<const BlobFile>> acquire(const BlobRef& blob) = 0;
  // For the hello: at most `limit`, the most recently used first.
  virtual std::vector<Digest> held(std::size_t limit) const = 0;
};

// Files that are here already, by digest.
class LocalFiles final : public BlobFiles {
 public:
  explicit LocalFiles(std::map<Digest, std::filesystem::path> files) : files_(std::move(files)) {}
  Result<std::shared_ptr<const BlobFile>> acquire(const BlobRef& blob) override;
  std::vector<Digest> held(std::size_t limit) const override;

 private:
  const std::map<Digest, std::filesystem::path> files_;
};

}  // namespace ls::worker
