// Lists and removes files in a cache folder (see cache.h). It considers only files with the cache's own names
// in their own places, so that other files in the folder are safe.
#pragma once

#include <sys/stat.h>

#include <cstdint>
#include <filesystem>
#include <optional>
#include <vector>

#include "common/base/digest.h"
#include "common/base/error.h"

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

// Removes the files of transfers that cannot be resumed, because they were private to a process that has
// ended.
void remove_orphans(const std::filesystem::path& folder);

// Locks the file `fd`, which was opened at `path`, by flock(2) without waiting; `how` is LOCK_SH or LOCK_EX.
// `lost`: another process has the lock, or `path` no longer names the file that was opened. `failed`: the
// file cannot be locked; errno has the reason.
enum class Lock { taken, lost, failed };
Lock lock_at(int fd, const std::filesystem::path& path, int how);

void write_cache_tag(const std::filesystem::path& folder);  // as specified at bford.info/cachedir

}  // namespace ls::worker
