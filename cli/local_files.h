// The files of an in-memory coordinator's blobs for the agent beside it: adopted files stay where they are,
// what is only in memory (the canonical scene) becomes a file in memory, which nothing leaves behind.
#pragma once

#include "coordinator/store/memory_blobs.h"
#include "worker/agent/blob_files.h"

namespace ls::cli {

class LocalBlobFiles final : public worker::BlobFiles {
 public:
  explicit LocalBlobFiles(std::shared_ptr<coordinator::MemoryBlobs> blobs) : blobs_(std::move(blobs)) {}
  // Its errors are final: nobody waits for this machine to get better.
  Result<std::shared_ptr<const worker::BlobFile>> acquire(const BlobRef& blob) override;
  std::vector<Digest> held(std::size_t) const override { return {}; }

 private:
  std::shared_ptr<coordinator::MemoryBlobs> blobs_;
};

}  // namespace ls::cli
