// File operations of the store: complete writes, durable renames, and errors that name the path and the
// remedy.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string_view>
#include <utility>
#include <vector>

#include "core/base/error.h"

namespace ls::coordinator {

// An owned file descriptor, closed by the destructor.
class File {
 public:
  File() = default;
  explicit File(int fd) : fd_(fd) {}
  ~File();
  File(File&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}
  File& operator=(File&& other) noexcept;

  // `flags` as in open(2); O_CLOEXEC is added.
  static Result<File> open(const std::filesystem::path& path, int flags, unsigned mode = 0640);
  int fd() const { return fd_; }
  explicit operator bool() const { return fd_ >= 0; }

 private:
  int fd_ = -1;
};

// Makes an error from errno. A full disk becomes resource_exhausted, a missing file not_found, a forbidden
// access permission_denied; most others become unavailable.
Error errno_error(std::string_view what, const std::filesystem::path& path);

Result<void> make_folder(const std::filesystem::path& folder);  // also creates its parents
Result<void> write_all(const File& file, std::span<const std::byte> bytes, const std::filesystem::path& path);
// Reads exactly `length` bytes from `offset` on; a shorter file is an error.
Result<std::vector<std::byte>> read_at(const File& file, std::uint64_t offset, std::size_t length,
                                       const std::filesystem::path& path);
Result<std::vector<std::byte>> read_file(const std::filesystem::path& path, std::uint64_t max_bytes);
Result<void> sync_data(const File& file, const std::filesystem::path& path);
Result<void> sync_folder(const std::filesystem::path& folder);
// Returns the paths of all that the folder contains.
Result<std::vector<std::filesystem::path>> list_folder(const std::filesystem::path& folder);
// Writes a temporary file, syncs it, renames it to `path` and syncs the folder, so that after a crash the
// file at `path` has either its old or its new content.
Result<void> write_atomically(const std::filesystem::path& path, std::span<const std::byte> bytes,
                              unsigned mode = 0640);

// Like write_atomically(), for content too large for memory: the content is written piece by piece to a file
// named PATH + `suffix`, which commit() renames to PATH. If the object is destroyed without a commit, the
// temporary file is removed.
class AtomicFile {
 public:
  static Result<AtomicFile> create(std::filesystem::path path, std::string_view suffix = ".tmp",
                                   unsigned mode = 0640);
  AtomicFile(AtomicFile&&) noexcept = default;
  ~AtomicFile();

  Result<void> write(std::span<const std::byte> bytes);  // appends
  Result<void> write_at(std::uint64_t offset, std::span<const std::byte> bytes);
  Result<void> sync();
  Result<void> commit();  // includes sync()
  // Like commit(), but without sync(). If this process is killed afterwards, the file has its new content;
  // after a power failure it may have the old content, be incomplete or be missing.
  Result<void> commit_unsynced();

 private:
  AtomicFile(std::filesystem::path path, std::filesystem::path temporary, File file)
      : path_(std::move(path)), temporary_(std::move(temporary)), file_(std::move(file)) {}

  std::filesystem::path path_, temporary_;
  File file_;  // has no descriptor after a move or a commit
};

// Locks `folder` for this process until the returned file is destroyed. failed_precondition: another process
// holds the lock.
Result<File> lock_folder(const std::filesystem::path& folder);

}  // namespace ls::coordinator
