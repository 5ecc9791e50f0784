// Files of secrets (tokens, and the key that signs webhooks): one line with 256 random bits in hexadecimal,
// readable by the owner only.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

#include "common/base/error.h"
#include "common/base/spawn.h"

namespace ls::http {

// Returns the secret in `file`; creates the file (mode 0600) with a new secret if it does not exist. Rejects
// a file that others may read, or with fewer than 16 characters. The caller must hold the data folder's lock,
// so that two starts do not race.
Result<std::string> read_or_make_token(const std::filesystem::path& file);

// Returns 256 random bits in hexadecimal.
Result<std::string> random_token();

// Reads a file of at most 1 MiB. Returns an empty text if there is no file. failed_precondition: users other
// than the owner may write the file (they may read it), or it is too large or cannot be opened.
Result<std::string> read_list(const std::filesystem::path& file);

// Identifies a version of a file: if two states differ, the file was replaced or written in between. All
// zero: there is no file.
struct FileState {
  std::uint64_t inode = 0, size = 0;
  std::int64_t changed_ns = 0;
  bool operator==(const FileState&) const = default;
};
FileState file_state(const std::filesystem::path& file);

// Holds a lock on a folder while the object lives, so that other processes do not change the folder's secrets
// meanwhile. The constructor blocks until it has the lock. If the folder is read-only, so that no lock file
// can be created, no lock is needed or held. An empty path locks nothing.
class FolderLock {
 public:
  explicit FolderLock(const std::filesystem::path& folder);

 private:
  Descriptor file_;
};

}  // namespace ls::http
