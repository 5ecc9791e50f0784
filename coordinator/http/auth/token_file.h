// Secrets in the data folder: one line with 256 random bits in hexadecimal, readable by the owner only.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

#include "common/base/error.h"

namespace ls::http {

// Returns the secret in `file`; creates it (mode 0600) if it does not exist. Rejects a file that others may
// read, or with fewer than 16 characters. The caller must hold the data folder's lock, so that two starts do
// not race.
Result<std::string> read_or_make_token(const std::filesystem::path& file);

// 256 random bits in hexadecimal.
Result<std::string> random_token();

// Reads a small file that others may read but not write; empty if there is none.
Result<std::string> read_list(const std::filesystem::path& file);

// Replaces the file in one step, mode 0600: a crash leaves the old one or the new one.
Result<void> write_private(const std::filesystem::path& file, std::string_view text);

// Identifies a state of a file: if two of these differ, the file was replaced or written between them. All
// zero: there is no file.
struct FileState {
  std::uint64_t inode = 0, size = 0;
  std::int64_t changed_ns = 0;
  bool operator==(const FileState&) const = default;
};
FileState file_state(const std::filesystem::path& file);

// Holds a lock on a folder while the object lives, so that other processes do not change the folder's secrets
// meanwhile. The constructor blocks until it has the lock. If no lock file can be created in the folder, it
// goes on without one: then nothing can be written there either. An empty path locks nothing.
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
