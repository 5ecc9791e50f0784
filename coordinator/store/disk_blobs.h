// Blobs as files: DIR/ab/<64 hex digits>, written under WORK/tmp, or in parts under WORK/unfinished, and
// renamed when digest and bytes are proven and synced. A file that no longer has its digest is found when it
// is read, and moved aside to <64 hex digits>.damaged until the right bytes come: it counts as missing.
#pragma once

#include <filesystem>
#include <memory>
#include <mutex>

#include "coordinator/service.h"
#include "coordinator/store/proof_book.h"
#include "coordinator/store/upload_parts.h"

namespace ls::coordinator {

class DiskBlobs final : public BlobStore {
 public:
  // Makes the folder; removes what abandoned uploads of an earlier process left in WORK/tmp. Where several
  // processes share the folder each has a work folder of its own in it.
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
  // Of a file that looked like this when it was read. Always an error: what is wrong, and what to do.
  tl::unexpected<Error> set_aside(const Digest& digest, const FileStamp& seen, const Digest& got) const;
  // To its place, from a file that is proven and synced.
  Result<void> place(const Digest& digest, const std::filesystem::path& from);

  std::filesystem::path folder_, work_;
  mutable ProofBook proofs_;
  mutable std::mutex proving_;  // one file at a time: who asks for the same one waits for its proof
  mutable std::mutex placing_;  // so that what has just been repaired is not set aside
  std::unique_ptr<UploadParts> parts_;
};

}  // namespace ls::coordinator
