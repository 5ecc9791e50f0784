// Blobs as files: DIR/ab/<64 hex digits>, written under DIR/tmp and renamed when digest and bytes are proven
// and synced.
#pragma once

#include <filesystem>
#include <memory>

#include "coordinator/service.h"

namespace ls::coordinator {

class DiskBlobs final : public BlobStore {
 public:
  // Makes the folder; removes what abandoned uploads of an earlier process left in DIR/tmp.
  static Result<std::unique_ptr<DiskBlobs>> open(std::filesystem::path folder);

  bool has(const Digest& digest) const override;
  Result<std::uint64_t> size(const Digest& digest) const override;
  Result<std::vector<std::byte>> read(const Digest& digest, std::uint64_t offset,
                                      std::uint64_t length) const override;
  Result<void> put(const Digest& digest, std::span<const std::byte> bytes) override;
  Result<std::unique_ptr<Upload>> begin_upload(const Digest& digest) override;

  std::filesystem::path path(const Digest& digest) const;

 private:
  explicit DiskBlobs(std::filesystem::path folder) : folder_(std::move(folder)) {}
  std::filesystem::path folder_;
};

}  // namespace ls::coordinator
