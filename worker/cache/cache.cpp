#include "worker/cache/cache.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>

#include "common/base/log.h"
#include "worker/cache/partial_file.h"

namespace ls::worker {
namespace fs = std::filesystem;
namespace {

constexpr int kAttempts = 3;  // at bytes that arrive whole but wrong

// Holds a shared lock on the file for as long as somebody uses it.
class LockedFile final : public BlobFile {
 public:
  LockedFile(fs::path path, int fd) : path_(std::move(path)), fd_(fd) {}
  LockedFile(const LockedFile&) = delete;
  LockedFile& operator=(const LockedFile&) = delete;
  ~LockedFile() override { ::close(fd_); }
  const fs::path& path() const override { return path_; }

 private:
  fs::path path_;
  int fd_;
};

struct Stored {
  fs::path path;
  Digest digest;
  std::uint64_t bytes = 0;
  timespec used{};
};

// All blobs in the folder, the least recently used first.
std::vector<Stored> stored_blobs(const fs::path& folder) {
  std::vector<Stored> found;
  std::error_code error;
  for (fs::recursive_directory_iterator it(folder, fs::directory_options::skip_permission_denied, error), end;
       !error && it != end; it.increment(error)) {
    const auto digest = Digest::parse(it->path().filename().string());
    struct stat info {};
    if (!digest || it->path().parent_path().filename() == "partial") continue;
    if (::stat(it->path().c_str(), &info) != 0 || !S_ISREG(info.st_mode)) continue;
    found.push_back({it->path(), *digest, static_cast<std::uint64_t>(info.st_size), info.st_mtim});
  }
  std::sort(found.begin(), found.end(), [](const Stored& a, const Stored& b) {
    return std::pair(a.used.tv_sec, a.used.tv_nsec) < std::pair(b.used.tv_sec, b.used.tv_nsec);
  });
  return found;
}

// Removes the file unless somebody uses it.
bool remove_unused(const fs::path& path) {
  const int fd = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (fd < 0) return false;
  const bool unused = ::flock(fd, LOCK_EX | LOCK_NB) == 0;
  const bool removed = unused && ::unlink(path.c_str()) == 0;
  ::close(fd);
  return removed;
}

}  // namespace

Result<std::unique_ptr<BlobCache>> BlobCache::open(fs::path folder, std::uint64_t limit_bytes, Fetch fetch) {
  std::error_code error;
  fs::create_directories(folder / "partial", error);
  if (error || ::access((folder / "partial").c_str(), W_OK) != 0)
    return fail(
        Errc::failed_precondition,
        fmt::format("cannot write into the cache folder {}; choose another with --cache", folder.string()));
  return std::unique_ptr<BlobCache>(new BlobCache(std::move(folder), limit_bytes, std::move(fetch)));
}

BlobCache::BlobCache(fs::path folder, std::uint64_t limit_bytes, Fetch fetch)
    : folder_(std::move(folder)), limit_(limit_bytes), fetch_(std::move(fetch)) {}

fs::path BlobCache::path_of(const Digest& digest) const {
  const std::string hex = digest.hex();
  return folder_ / hex.substr(0, 2) / hex;
}

Result<std::shared_ptr<const BlobFile>> BlobCache::acquire(const BlobRef& blob) {
  const std::lock_guard lock(mutex_);
  Error last;
  for (int attempt = 0; attempt < kAttempts; ++attempt) {
    if (auto file = open_verified(blob.digest)) return file;
    const auto fetched = download(blob);
    if (fetched) continue;
    last = fetched.error();
    if (last.code != Errc::invalid_argument) return tl::unexpected<Error>(last);
    log_warn("blob=" + blob.digest.hex(), last.message);
  }
  if (auto file = open_verified(blob.digest)) return file;
  return fail(Errc::invalid_argument,
              fmt::format("'{}' arrived wrong {} times: {}", blob.name, kAttempts, last.message));
}

// Nothing if it is not here, or is not what its name says (then it is removed).
std::shared_ptr<const BlobFile> BlobCache::open_verified(const Digest& digest) {
  const fs::path path = path_of(digest);
  const int fd = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (fd < 0) return nullptr;
  auto file = std::make_shared<const LockedFile>(path, fd);
  if (::flock(fd, LOCK_SH | LOCK_NB) != 0 || ::access(path.c_str(), R_OK) != 0)
    return nullptr;  // being evicted
  if (!verified_.contains(digest)) {
    const auto found = sha256_file(path);
    if (!found || *found != digest) {
      log_warn("blob=" + digest.hex(), "the cached file is damaged; fetching it again");
      ::unlink(path.c_str());
      return nullptr;
    }
    verified_.insert(digest);
  }
  ::futimens(fd, nullptr);  // used now
  return file;
}

Result<void> BlobCache::download(const BlobRef& blob) {
  verified_.erase(blob.digest);
  if (auto ok = make_room(blob.bytes); !ok) return ok;
  auto partial = PartialFile::open(folder_ / "partial" / blob.digest.hex());
  if (!partial) return tl::unexpected<Error>(partial.error());
  const auto sink = [&](std::span<const std::byte> bytes) -> Result<void> {
    if (blob.bytes != 0 && partial->size() + bytes.size() > blob.bytes)
      return fail(Errc::invalid_argument,
                  fmt::format("'{}' is longer than the {} bytes announced", blob.name, blob.bytes));
    return partial->append(bytes);
  };
  const auto fetched = fetch_(blob.digest, partial->size(), sink);
  if (!fetched) {
    // What came of a cut transfer is kept; anything else is not worth keeping.
    if (fetched.error().code != Errc::unavailable) partial->discard();
    return fetched;
  }
  auto finished = partial->finish(blob.digest, path_of(blob.digest));
  if (finished) verified_.insert(blob.digest);
  return finished;
}

Result<void> BlobCache::make_room(std::uint64_t bytes) {
  if (limit_ == 0) return {};
  const std::vector<Stored> blobs = stored_blobs(folder_);
  std::uint64_t total = bytes;
  for (const Stored& blob : blobs) total += blob.bytes;
  for (const Stored& blob : blobs) {
    if (total <= limit_) return {};
    if (!remove_unused(blob.path)) continue;
    verified_.erase(blob.digest);
    total -= blob.bytes;
  }
  if (total <= limit_) return {};
  return fail(
      Errc::resource_exhausted,
      fmt::format("the cache is limited to {} bytes and what is in use leaves no room for {} more; raise "
                  "--cache-limit",
                  limit_, bytes));
}

std::vector<Digest> BlobCache::held(std::size_t limit) const {
  const std::vector<Stored> blobs = stored_blobs(folder_);
  std::vector<Digest> digests;
  for (auto it = blobs.rbegin(); it != blobs.rend() && digests.size() < limit; ++it)
    digests.push_back(it->digest);
  return digests;
}

}  // namespace ls::worker
