// Secrets kept in the data folder: one line, 256 random bits in hexadecimal, readable by its owner only.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

#include "common/base/error.h"

namespace ls::http {

// The secret in `file`; made (mode 0600) if there is none yet. A file that others may read, or that holds
// fewer than 16 characters, is refused. The caller holds the data folder's lock: two starts don't race here.
Result<std::string> read_or_make_token(const std::filesystem::path& file);

// 256 random bits in hexadecimal.
Result<std::string> random_token();

// A small file that others may read, but not write; empty if there is none.
Result<std::string> read_list(const std::filesystem::path& file);

// Replaces the file in one step, mode 0600: a crash leaves the old one or the new one.
Result<void> write_private(const std::filesystem::path& file, std::string_view text);

// What tells that a file has been replaced; all zero where there is none.
struct FileState {
  std::uint64_t inode = 0, size = 0;
  std::int64_t changed_ns = 0;
  bool operator==(const FileState&) const = default;
};
FileState file_state(const std::filesystem::path& file);

// Keeps other processes out of a folder's secrets while it lives; waits for them. Best effort: in a folder
// where no file can be made nothing will be written either. An empty path: nothing.
class FolderLock {
 public:
  explicit FolderLock(const std::filesystem::path& folder);
  ~FolderLock();
  FolderLock(const FolderLock&) = delete;
  FolderLock& operator=(const FolderLock&) = delete;

 private:
  int fd_ = -1;
};

}  // namespace ls::http
