// Blobs that arrive in parts: files FOLDER/<64 hex digits> that grow, over broken connections and restarts,
// until they are whole. Thread-safe.
#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <vector>

#include "coordinator/service.h"

namespace ls::coordinator {

class UploadParts {
 public:
  // Takes a whole file of proven digest away from its path (renames or copies and removes it).
  using Publish = std::function<Result<void>(const Digest&, const std::filesystem::path&)>;
  static Result<std::unique_ptr<UploadParts>> open(std::filesystem::path folder, Publish publish);
  ~UploadParts();

  std::uint64_t received(const Digest& digest) const;
  // As BlobStore::resume_upload(). Of more than limits::kMaxUnfinishedUploads the one goes that has not grown
  // for the longest time.
  Result<std::unique_ptr<BlobStore::Upload>> resume(const Digest& digest, std::uint64_t offset);
  void remove(const Digest& digest);  // one that is being written goes on, and is refused its next bytes
  Result<std::vector<Digest>> list() const;

 private:
  struct Slot;
  class Part;
  UploadParts(std::filesystem::path folder, Publish publish);
  std::filesystem::path path(const Digest& digest) const { return folder_ / digest.hex(); }
  std::shared_ptr<Slot> slot(const Digest& digest);
  void make_room();

  std::filesystem::path folder_;
  Publish publish_;
  std::mutex mutex_;
  std::map<Digest, std::weak_ptr<Slot>> slots_;  // of those that somebody writes
};

}  // namespace ls::coordinator
