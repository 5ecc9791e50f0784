// Gives the worker agent in this process the blobs (files by digest) of the in-memory coordinator as files.
// Adopted files stay where they are; blobs in memory (the canonical scene) become memory files, which leave
// nothing behind.
#pragma once

#include "coordinator/store/blobs/memory_blobs.h"
#include "worker/agent/blob_files.h"

namespace ls::cli {

class LocalBlobFiles final : public worker::BlobFiles {
 public:
  explicit LocalBlobFiles(std::shared_ptr<coordinator::MemoryBlobs> blobs) : blobs_(std::move(blobs)) {}
  // Errors of acquire() are final: there is no point in waiting for this machine to recover.
  Result<std::shared_ptr<const worker::BlobFile>> acquire(const BlobRef& blob) override;
  std::vector<Digest> held(std::size_t) const override { return {}; }

 private:
  std::shared_ptr<coordinator::MemoryBlobs> blobs_;
};

}  // namespace ls::cli
