// Remembers which files this process has read as a whole and found to match their digests, with each file's
// stamp at that time. A file whose stamp has changed since must be read again. Thread-safe.
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

// Identifies a state of a file: any write changes the time of the last change (ctime, here `seconds` and
// `nanoseconds`), which programs cannot set.
struct FileStamp {
  std::uint64_t device = 0, inode = 0, bytes = 0;
  std::int64_t seconds = 0, nanoseconds = 0;
  bool operator==(const FileStamp&) const = default;
};

// Returns the file's present stamp; nullopt: it cannot be read, and errno says why.
inline std::optional<FileStamp> stamp_of(const std::filesystem::path& path) {
  struct stat info {};
  if (::stat(path.c_str(), &info) != 0) return std::nullopt;
  return FileStamp{info.st_dev, info.st_ino, static_cast<std::uint64_t>(info.st_size), info.st_ctim.tv_sec,
                   info.st_ctim.tv_nsec};
}

class VerifiedDigests {
 public:
  // True if the file of this blob was found right when it had this stamp.
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
