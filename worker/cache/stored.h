// What lies in a cache folder: only files with the cache's own names at their own places are seen, so that a
// folder which holds other things, too, keeps them.
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

// The least recently used first. Links and whatever else is no regular file are not seen.
std::vector<StoredFile> stored_blobs(const std::filesystem::path& folder);
std::vector<StoredFile> stored_partials(const std::filesystem::path& folder);  // on their way, or left behind

// Removes the file unless somebody has it locked.
bool remove_unused(const std::filesystem::path& path);

// Removes what nobody will ever go on with: parts that a process which is gone had for itself alone.
void remove_orphans(const std::filesystem::path& folder);

// Takes a lock (of flock) without waiting. `lost`: somebody else has it, or the path was given to another
// file between opening and locking. `failed`: this file system cannot lock; see errno.
enum class Lock { taken, lost, failed };
Lock lock_at(int fd, const std::filesystem::path& path, int how);

void write_cache_tag(const std::filesystem::path& folder);  // bford.info/cachedir

}  // namespace ls::worker
