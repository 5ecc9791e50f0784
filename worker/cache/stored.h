// Lists and removes files in a cache folder. Considers only files with the cache's own names in their own
// places, so that other files in the folder are safe.
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

// Least recently used first. Ignores links and other non-regular files.
std::vector<StoredFile> stored_blobs(const std::filesystem::path& folder);
std::vector<StoredFile> stored_partials(const std::filesystem::path& folder);  // in transfer, or left behind

// Removes the file unless another process has it locked.
bool remove_unused(const std::filesystem::path& path);

// Removes partial files that cannot be resumed: those private to a process that has ended.
void remove_orphans(const std::filesystem::path& folder);

// Takes a flock without waiting. `lost`: another process has it, or the path was given to another file
// between opening and locking. `failed`: this file system cannot lock; see errno.
enum class Lock { taken, lost, failed };
Lock lock_at(int fd, const std::filesystem::path& path, int how);

void write_cache_tag(const std::filesystem::path& folder);  // bford.info/cachedir

}  // namespace ls::worker
