// Files that this process has read whole and found to match their digest, with their stamps: a file whose
// stamp has changed must be read again. Thread-safe.
#pragma once

#include <sys/stat.h>

#include <cerrno>
#include <cstdint>
#include <filesystem>
#include <map>
#include <mutex>
#include <optional>

#include "common/base/digest.h"

namespace ls::coordinator {

// Identifies a file's state. Any write changes ctime, which programs cannot set.
struct FileStamp {
  std::uint64_t device = 0, inode = 0, bytes = 0;
  std::int64_t seconds = 0, nanoseconds = 0;
  bool operator==(const FileStamp&) const = default;
};

// nullopt: see errno.
inline std::optional<FileStamp> stamp_of(const std::filesystem::path& path) {
  struct stat info {};
  if (::stat(path.c_str(), &info) != 0) return std::nullopt;
  return FileStamp{info.st_dev, info.st_ino, static_cast<std::uint64_t>(info.st_size), info.st_ctim.tv_sec,
                   info.st_ctim.tv_nsec};
}

class VerifiedDigests {
 public:
  bool proven(const Digest& digest, const FileStamp& stamp) const {
    const std::lock_guard lock(mutex_);
    const auto found = stamps_.find(digest);
    return found != stamps_.end() && found->second == stamp;
  }
  void note(const Digest& digest, const FileStamp& stamp) {
    const std::lock_guard lock(mutex_);
    stamps_.insert_or_assign(digest, stamp);
  }
  void forget(const Digest& digest) {
    const std::lock_guard lock(mutex_);
    stamps_.erase(digest);
  }

 private:
  mutable std::mutex mutex_;
  std::map<Digest, FileStamp> stamps_;
};

}  // namespace ls::coordinator
