// Files as the store needs them: whole writes, durable renames, errors that name the path and what to do.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string_view>
#include <utility>
#include <vector>

#include "common/base/error.h"

namespace ls::coordinator {

// An open file descriptor, closed when it goes.
class File {
 public:
  File() = default;
  explicit File(int fd) : fd_(fd) {}
  ~File();
  File(File&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}
  File& operator=(File&& other) noexcept;

  // `flags` as of open(2); O_CLOEXEC is added.
  static Result<File> open(const std::filesystem::path& path, int flags, unsigned mode = 0640);
  int fd() const { return fd_; }
  explicit operator bool() const { return fd_ >= 0; }

 private:
  int fd_ = -1;
};

// The error of a failed call, from errno: a full disk is resource_exhausted, a missing file not_found.
Error errno_error(std::string_view what, const std::filesystem::path& path);

Result<void> make_folder(const std::filesystem::path& folder);  // and its parents; mode 0750
Result<void> write_all(const File& file, std::span<const std::byte> bytes, const std::filesystem::path& path);
// Exactly `length` bytes from `offset`; fewer is an error.
Result<std::vector<std::byte>> read_at(const File& file, std::uint64_t offset, std::size_t length,
                                       const std::filesystem::path& path);
Result<std::vector<std::byte>> read_file(const std::filesystem::path& path, std::uint64_t max_bytes);
Result<void> sync_data(const File& file, const std::filesystem::path& path);
Result<void> sync_folder(const std::filesystem::path& folder);
// Temporary file, fsync, rename, fsync of the folder: after a crash the old or the new content stands there,
// whole.
Result<void> write_atomically(const std::filesystem::path& path, std::span<const std::byte> bytes);

// The same of what is too large for memory at once: written piece by piece to PATH + `suffix`, and whole at
// its place only after commit(). One that is not committed leaves nothing.
class AtomicFile {
 public:
  static Result<AtomicFile> create(std::filesystem::path path, std::string_view suffix = ".tmp");
  AtomicFile(AtomicFile&&) noexcept = default;
  ~AtomicFile();

  Result<void> write(std::span<const std::byte> bytes);  // behind what is there
  Result<void> write_at(std::uint64_t offset, std::span<const std::byte> bytes);
  Result<void> sync();
  Result<void> commit();  // with sync()
  // Without: after a power failure the old or no content may stand there, after a crash of this process the
  // new one.
  Result<void> commit_unsynced();

 private:
  AtomicFile(std::filesystem::path path, std::filesystem::path temporary, File file)
      : path_(std::move(path)), temporary_(std::move(temporary)), file_(std::move(file)) {}

  std::filesystem::path path_, temporary_;
  File file_;  // none: moved from, or committed
};

// Holds `folder` for this process alone until destroyed. failed_precondition if another one has it.
Result<File> lock_folder(const std::filesystem::path& folder);

}  // namespace ls::coordinator
