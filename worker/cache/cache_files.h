// The files in a cache folder (see cache.h): complete blobs, and blobs in transfer. Files are listed and
// removed only if they have a name and a place that the cache gives to its files, so other files in the
// folder are safe.
#pragma once

#include <sys/stat.h>

#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "core/base/digest.h"
#include "core/base/error.h"

namespace ls::worker {

inline constexpr const char* kPartialFolder = "partial";

struct StoredFile {
  std::filesystem::path path;
  Digest digest;
  std::uint64_t bytes = 0;
  timespec used{};
};

std::filesystem::path blob_path(const std::filesystem::path& folder, const Digest& digest);

// Returns the complete blobs in the folder, the least recently used first. Ignores links and other files that
// are not regular.
std::vector<StoredFile> stored_blobs(const std::filesystem::path& folder);
// Returns the files of blobs that are in transfer or whose transfer was abandoned.
std::vector<StoredFile> stored_partials(const std::filesystem::path& folder);

// Removes the file unless another process has it locked.
bool remove_unused(const std::filesystem::path& path);

// Removes files of transfers that no process can resume: those with a random suffix (see
// PartialFile::open()), which belonged to one process only, if that process has ended.
void remove_orphans(const std::filesystem::path& folder);

// Locks the file `fd`, which was opened at `path`, by flock(2) without waiting; `how` is LOCK_SH or LOCK_EX.
// `lost`: another process has the lock, or `path` no longer names the file that was opened. `failed`: the
// file cannot be locked; errno has the reason.
enum class Lock { taken, lost, failed };
Lock lock_at(int fd, const std::filesystem::path& path, int how);

// Writes CACHEDIR.TAG, which makes backups skip the folder (specified at bford.info/cachedir).
void write_cache_tag(const std::filesystem::path& folder);

// Returns the error for an operation on `path` that has just failed and set errno. Its code is
// resource_exhausted if the disk is full, else internal.
tl::unexpected<Error> io_error(const std::string& what, const std::filesystem::path& path);

// The file of a blob in transfer (a partial file): bytes are appended to it while their digest is computed. A
// transfer continues after the bytes that an earlier attempt left in the file. The file is locked, so that
// two workers that share a folder cannot write to the same file.
//
// Errors: resource_exhausted if the disk is full, internal if this machine cannot write or read for another
// reason.
class PartialFile {
 public:
  // Opens or creates the file at `path` and reads the bytes that are in it already, to compute their digest.
  // If another process is writing that file, creates a file with a random suffix for this transfer instead.
  static Result<PartialFile> open(const std::filesystem::path& path);
  PartialFile(PartialFile&&) noexcept;
  PartialFile& operator=(PartialFile&&) = delete;
  ~PartialFile();

  const std::filesystem::path& path() const { return path_; }
  std::uint64_t size() const { return size_; }
  Result<void> append(std::span<const std::byte> bytes);
  // Checks the digest, syncs the file and moves it to `place`. Returns false if `place` already has a file,
  // which is kept, since it may be in use. Fails with invalid_argument if the digest is not `expected`; the
  // file is then removed.
  Result<bool> finish(const Digest& expected, const std::filesystem::path& place);
  void discard();

 private:
  PartialFile(std::filesystem::path path, int fd) : path_(std::move(path)), fd_(fd) {}
  static Result<PartialFile> open_own(const std::filesystem::path& path);
  Result<void> read_existing();

  std::filesystem::path path_;
  int fd_ = -1;
  std::uint64_t size_ = 0;
  Sha256 hash_;
};

}  // namespace ls::worker
