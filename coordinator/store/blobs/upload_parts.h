// Receives blobs in parts. An incomplete blob is a file, FOLDER/<its SHA-256 in hex>, to which each part is
// appended. It outlives broken connections and restarts of the coordinator. Thread-safe.
#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <vector>

#include "common/base/guarded.h"
#include "coordinator/store/blobs/blob_store.h"

namespace ls::coordinator {

class UploadParts {
 public:
  // Moves a complete, verified file away from its path (renames it, or copies and removes it).
  using Publish = std::function<Result<void>(const Digest&, const std::filesystem::path&)>;
  static Result<std::unique_ptr<UploadParts>> open(std::filesystem::path folder, Publish publish);
  ~UploadParts();

  std::uint64_t received(const Digest& digest) const;
  // Implements BlobStore::resume_upload(). If there are limits::kMaxUnfinishedUploads incomplete blobs
  // already, first removes the one that has not grown for the longest time.
  Result<std::unique_ptr<BlobStore::Upload>> resume(const Digest& digest, std::uint64_t offset);
  // Removes an incomplete blob. If its upload is in progress, the next bytes of that upload are rejected. A
  // blob whose finish() is running stays.
  void remove(const Digest& digest);
  Result<std::vector<Digest>> list() const;

 private:
  struct Slot;
  class Part;
  UploadParts(std::filesystem::path folder, Publish publish);
  std::filesystem::path path(const Digest& digest) const { return folder_ / digest.hex(); }
  std::shared_ptr<Guarded<Slot>> slot(const Digest& digest);
  void make_room();

  std::filesystem::path folder_;
  Publish publish_;
  Guarded<std::map<Digest, std::weak_ptr<Guarded<Slot>>>> slots_;  // the uploads in progress
};

}  // namespace ls::coordinator
