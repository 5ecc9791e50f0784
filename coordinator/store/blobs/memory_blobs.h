// The blob store of a process that writes nothing to disk (`lightshaft render`): a blob is in memory, or is
// an existing file that stays where it is.
#pragma once

#include <filesystem>
#include <map>
#include <mutex>
#include <optional>
#include <variant>

#include "coordinator/store/blobs/blob_store.h"

namespace ls::coordinator {

class MemoryBlobs : public BlobStore {
 public:
  // Makes the file at `path` the blob with this digest. The caller has computed the digest of the file, which
  // must not change afterwards.
  Result<void> adopt(const Digest& digest, std::filesystem::path path);
  std::optional<std::filesystem::path> adopted(const Digest& digest) const;

  bool has(const Digest& digest) const override;
  Result<std::uint64_t> size(const Digest& digest) const override;
  Result<std::vector<std::byte>> read(const Digest& digest, std::uint64_t offset,
                                      std::uint64_t length) const override;
  Result<void> put(const Digest& digest, std::span<const std::byte> bytes) override;
  Result<std::unique_ptr<Upload>> begin_upload(const Digest& digest) override;

 private:
  struct Adopted {
    std::filesystem::path path;
    std::uint64_t bytes = 0;
  };
  using Blob = std::variant<std::vector<std::byte>, Adopted>;
  mutable std::mutex mutex_;
  std::map<Digest, Blob> blobs_;
};

}  // namespace ls::coordinator
