#include "worker/cache/stored.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <fstream>
#include <string>
#include <utility>

namespace ls::worker {
namespace fs = std::filesystem;
namespace {

constexpr std::size_t kDigestDigits = 64;

void look_at(const fs::path& path, const Digest& digest, std::vector<StoredFile>& found) {
  struct stat info {};
  if (::lstat(path.c_str(), &info) != 0 || !S_ISREG(info.st_mode)) return;
  found.push_back({path, digest, static_cast<std::uint64_t>(info.st_size), info.st_mtim});
}

template <class See>
void for_each_in(const fs::path& folder, See see) {
  std::error_code error;
  for (fs::directory_iterator it(folder, fs::directory_options::skip_permission_denied, error), end;
       !error && it != end; it.increment(error))
    see(it->path());
}

void oldest_first(std::vector<StoredFile>& files) {
  std::sort(files.begin(), files.end(), [](const StoredFile& a, const StoredFile& b) {
    return std::pair(a.used.tv_sec, a.used.tv_nsec) < std::pair(b.used.tv_sec, b.used.tv_nsec);
  });
}

}  // namespace

fs::path blob_path(const fs::path& folder, const Digest& digest) {
  const std::string hex = digest.hex();
  return folder / hex.substr(0, 2) / hex;
}

std::vector<StoredFile> stored_blobs(const fs::path& folder) {
  std::vector<StoredFile> found;
  for_each_in(folder, [&](const fs::path& inner) {
    struct stat info {};
    if (inner.filename().string().size() != 2 || ::lstat(inner.c_str(), &info) != 0 || !S_ISDIR(info.st_mode))
      return;
    for_each_in(inner, [&](const fs::path& path) {
      const auto digest = Digest::parse(path.filename().string());
      if (digest && path == blob_path(folder, *digest)) look_at(path, *digest, found);
    });
  });
  oldest_first(found);
  return found;
}

std::vector<StoredFile> stored_partials(const fs::path& folder) {
  std::vector<StoredFile> found;
  for_each_in(folder / kPartialFolder, [&](const fs::path& path) {
    // The name is DIGEST, or DIGEST.XXXXXX if another process had locked the file DIGEST.
    const std::string name = path.filename().string();
    const auto digest = Digest::parse(std::string_view(name).substr(0, kDigestDigits));
    if (digest && (name.size() == kDigestDigits || name[kDigestDigits] == '.')) look_at(path, *digest, found);
  });
  oldest_first(found);
  return found;
}

bool remove_unused(const fs::path& path) {
  const int fd = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW);
  if (fd < 0) return false;
  const bool removed = lock_at(fd, path, LOCK_EX) == Lock::taken && ::unlink(path.c_str()) == 0;
  ::close(fd);
  return removed;
}

void remove_orphans(const fs::path& folder) {
  for (const StoredFile& file : stored_partials(folder))
    if (file.path.filename().string().size() > kDigestDigits) remove_unused(file.path);
}

Lock lock_at(int fd, const fs::path& path, int how) {
  if (::flock(fd, how | LOCK_NB) != 0) return errno == EWOULDBLOCK ? Lock::lost : Lock::failed;
  struct stat opened {
  }, there{};
  if (::fstat(fd, &opened) != 0) return Lock::failed;
  if (::stat(path.c_str(), &there) != 0) return errno == ENOENT ? Lock::lost : Lock::failed;
  return opened.st_dev == there.st_dev && opened.st_ino == there.st_ino ? Lock::taken : Lock::lost;
}

void write_cache_tag(const fs::path& folder) {
  std::error_code error;
  const fs::path tag = folder / "CACHEDIR.TAG";
  if (fs::exists(fs::symlink_status(tag, error))) return;
  std::ofstream(tag) << "Signature: 8a477f597d28d172789f06886806bc55\n"
                        "# Scenes and assets that lightshaft-worker has fetched. They may be deleted.\n";
}

}  // namespace ls::worker
