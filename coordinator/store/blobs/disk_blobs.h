// Keeps each blob as a file DIR/ab/<64 hex digits>. The file is written under WORK/tmp, or for uploads in
// parts under WORK/unfinished, and renamed when its digest is verified and its bytes are synced. A file that
// no longer matches its digest is detected when it is read. It is then moved aside to <64 hex
// digits>.damaged, and the blob counts as missing until the right bytes arrive.
#pragma once

#include <sys/stat.h>

#include <cerrno>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <vector>

#include "coordinator/store/blobs/blob_store.h"
#include "core/base/digest.h"
#include "core/base/guarded.h"

namespace ls::coordinator {

// Identifies a version of a file by its device, inode, size and time of last change (ctime, here `seconds`
// and `nanoseconds`). Every write changes the ctime, and programs cannot set it.
struct FileStamp {
  std::uint64_t device = 0, inode = 0, bytes = 0;
  std::int64_t seconds = 0, nanoseconds = 0;
  bool operator==(const FileStamp&) const = default;
};

// Returns the file's present stamp; nullopt: it cannot be read; the reason is in errno.
inline std::optional<FileStamp> stamp_of(const std::filesystem::path& path) {
  struct stat info {};
  if (::stat(path.c_str(), &info) != 0) return std::nullopt;
  return FileStamp{info.st_dev, info.st_ino, static_cast<std::uint64_t>(info.st_size), info.st_ctim.tv_sec,
                   info.st_ctim.tv_nsec};
}

// Returns the digests that are names of files in the folder.
Result<std::vector<Digest>> digests_in(const std::filesystem::path& folder);

// Receives blobs in parts. An incomplete blob is a file, FOLDER/<its SHA-256 in hex>, to which each part is
// appended. It outlives broken connections and restarts of the coordinator. Thread-safe.
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
  Result<std::vector<Digest>> list() const { return digests_in(folder_); }

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

class DiskBlobs final : public BlobStore {
 public:
  // Creates `folder` (DIR above) and removes uploads that earlier processes left in WORK/tmp. If several
  // processes share the folder, each needs a `work` folder (WORK) of its own on the same file system; by
  // default it is `folder` itself.
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
  bool proven(const Digest& digest, const FileStamp& stamp) const;
  // Moves the blob's file aside, if it still has the stamp `seen` that it had when it was read; `got` is the
  // digest of the bytes read. Always returns an error, with the cause and the remedy.
  tl::unexpected<Error> set_aside(const Digest& digest, const FileStamp& seen, const Digest& got) const;
  // Moves a verified and synced file to its place.
  Result<void> place(const Digest& digest, const std::filesystem::path& from);

  std::filesystem::path folder_, work_;
  // The blobs that this process has read as a whole and found to match their digests, with the stamp of each
  // file at that time. A file whose stamp has changed since must be read again.
  mutable Guarded<std::map<Digest, FileStamp>> proofs_;
  mutable std::mutex proving_;  // held while a file is verified; a second request waits and uses the result
  // Held while a file is moved to its place or moved aside. Without it, an upload could replace a damaged
  // file just before the file is moved aside, and then the good file would be moved aside.
  mutable std::mutex placing_;
  std::unique_ptr<UploadParts> parts_;
};

}  // namespace ls::coordinator
