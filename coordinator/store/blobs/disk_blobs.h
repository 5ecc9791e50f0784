// Blobs as files: DIR/ab/<64 hex digits>, written under WORK/tmp, or in parts under WORK/unfinished, and
// renamed when digest and bytes are verified and synced. A file that no longer matches its digest is detected
// when it is read, and moved aside to <64 hex digits>.damaged until the right bytes arrive: it counts as
// missing.
#pragma once

#include <filesystem>
#include <memory>
#include <mutex>

#include "coordinator/store/blobs/blob_store.h"
#include "coordinator/store/blobs/upload_parts.h"
#include "coordinator/store/blobs/verified_digests.h"

namespace ls::coordinator {

class DiskBlobs final : public BlobStore {
 public:
  // Creates the folder and removes abandoned uploads of earlier processes from WORK/tmp. If several processes
  // share the folder, each has its own work folder in it.
  static Result<std::unique_ptr<DiskBlobs>> open(const std::filesystem::path& folder) {
    return open(folder, folder);
  }
  static Result<std::unique_ptr<DiskBlobs>> open(std::filesystem::path folder, std::filesystem::path work);

  bool has(const Digest& digest) const override;
  Result<bool> find(const Digest& digest) const override;
  Result<void> prove(const Digest& digest, bool again = false) const override;
  Result<std::uint64_t> size(const Digest& digest) const override;
  Result<std::vector<std::byte>> read(const Digest& digest, std::uint64_t offset,
                                      std::uint64_t length) const override;
  Result<void> put(const Digest& digest, std::span<const std::byte> bytes) override;
  Result<std::unique_ptr<Upload>> begin_upload(const Digest& digest) override;

  std::uint64_t received(const Digest& digest) const override;
  Result<std::unique_ptr<Upload>> resume_upload(const Digest& digest, std::uint64_t offset) override;
  Result<std::vector<Digest>> list(bool unfinished) const override;
  Result<void> remove(const Digest& digest) override;
  void remove_unfinished(const Digest& digest) override { parts_->remove(digest); }

  std::filesystem::path path(const Digest& digest) const;

 private:
  DiskBlobs(std::filesystem::path folder, std::filesystem::path work)
      : folder_(std::move(folder)), work_(std::move(work)) {}
  Result<FileStamp> look_at(const Digest& digest) const;
  // Moves aside a file that had this stamp when it was read. Always an error: what is wrong, and what to do.
  tl::unexpected<Error> set_aside(const Digest& digest, const FileStamp& seen, const Digest& got) const;
  // Moves a verified and synced file to its place.
  Result<void> place(const Digest& digest, const std::filesystem::path& from);

  std::filesystem::path folder_, work_;
  mutable VerifiedDigests proofs_;
  mutable std::mutex proving_;  // one file at a time: a second request for the same file waits for the result
  mutable std::mutex placing_;  // so that a file just repaired is not moved aside
  std::unique_ptr<UploadParts> parts_;
};

}  // namespace ls::coordinator
