#include "worker/cache/cache.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "core/base/log.h"
#include "core/base/spawn.h"
#include "worker/cache/cache_files.h"

namespace ls::worker {
namespace fs = std::filesystem;
namespace {

// Number of attempts to fetch a blob that arrives complete but with a wrong digest
constexpr int kAttempts = 3;

// A blob's file with a shared lock, which the object holds while it lives.
class LockedFile final : public BlobFile {
 public:
  LockedFile(fs::path path, int fd) : path_(std::move(path)), file_(fd) {}
  const fs::path& path() const override { return path_; }

 private:
  const fs::path path_;
  const Descriptor file_;
};

// Changes the code of a transfer error so that the agent tries again later: it does so after unavailable,
// resource_exhausted and internal, so all other codes become internal. No transfer error is final, because a
// blob that is missing, damaged or denied at the coordinator may be available there later.
Error passing(Error error) {
  const bool temporary = error.code == Errc::unavailable || error.code == Errc::resource_exhausted;
  if (!temporary) error.code = Errc::internal;
  return error;
}

}  // namespace

Result<std::unique_ptr<BlobCache>> BlobCache::open(fs::path folder, std::uint64_t limit_bytes, Fetch fetch) {
  std::error_code error;
  fs::create_directories(folder / kPartialFolder, error);
  if (error || ::access((folder / kPartialFolder).c_str(), W_OK) != 0)
    return fail(
        Errc::failed_precondition,
        fmt::format("cannot write into the cache folder {}; choose another with --cache", folder.string()));
  write_cache_tag(folder);
  remove_orphans(folder);
  return std::unique_ptr<BlobCache>(new BlobCache(std::move(folder), limit_bytes, std::move(fetch)));
}

BlobCache::BlobCache(fs::path folder, std::uint64_t limit_bytes, Fetch fetch)
    : folder_(std::move(folder)), limit_(limit_bytes), fetch_(std::move(fetch)) {}

Result<std::shared_ptr<const BlobFile>> BlobCache::acquire(const BlobRef& blob,
                                                           const std::atomic<bool>& stop) {
  const std::lock_guard lock(mutex_);
  std::string reason;
  bool arrived_wrong = false;
  for (int attempt = 0; attempt < kAttempts; ++attempt) {
    auto file = open_verified(blob.digest);
    if (!file || *file) return file;
    const auto fetched = download(blob, arrived_wrong, stop);
    reason = fetched ? "it was evicted by another worker" : fetched.error().message;
    if (!fetched && fetched.error().code != Errc::invalid_argument)
      return tl::unexpected<Error>(passing(fetched.error()));
    arrived_wrong = !fetched;
    if (!fetched) log_warn("blob=" + blob.digest.hex(), reason);
  }
  auto file = open_verified(blob.digest);
  if (!file || *file) return file;
  return fail(Errc::internal, fmt::format("'{}' arrived wrong {} times: {}", blob.name, kAttempts, reason));
}

// Returns the blob's file. Returns null if the blob is not in the cache, or if the file's digest was wrong;
// such a file is removed. Returns an error if this machine cannot check the file; then fetching the blob
// again would not help.
Result<std::shared_ptr<const BlobFile>> BlobCache::open_verified(const Digest& digest) {
  const std::shared_ptr<const BlobFile> none;
  const fs::path path = blob_path(folder_, digest);
  const int fd = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (fd < 0 && errno == ENOENT) return none;
  if (fd < 0) return io_error("cannot open", path);
  auto file = std::make_shared<const LockedFile>(path, fd);
  const Lock lock = lock_at(fd, path, LOCK_SH);
  if (lock == Lock::failed) return io_error("cannot lock", path);
  if (lock == Lock::lost) return none;  // another process is removing the file
  if (!verified_.contains(digest)) {
    const auto found = sha256_file(path);
    if (!found) return fail(Errc::internal, found.error().message);
    if (*found != digest) {
      log_warn("blob=" + digest.hex(), "the cached file is damaged; fetching it again");
      ::unlink(path.c_str());
      return none;
    }
    verified_.insert(digest);
  }
  ::futimens(fd, nullptr);  // the time of the last change counts as the time of last use
  return file;
}

Result<void> BlobCache::download(const BlobRef& blob, bool arrived_wrong, const std::atomic<bool>& stop) {
  verified_.erase(blob.digest);
  // The folder may have been removed since the start: caches are cleaned up
  std::error_code error;
  if (fs::create_directories(folder_ / kPartialFolder, error)) write_cache_tag(folder_);
  auto partial = PartialFile::open(folder_ / kPartialFolder / blob.digest.hex());
  if (!partial) return tl::unexpected<Error>(partial.error());
  const auto received = receive(blob, arrived_wrong, stop, *partial);
  // After an interrupted transfer (unavailable) the received bytes are kept, so that it can be resumed. After
  // any other error they are useless.
  if (!received && received.error().code != Errc::unavailable) partial->discard();
  if (!received) return received;
  const auto finished = partial->finish(blob.digest, blob_path(folder_, blob.digest));
  if (!finished) return tl::unexpected<Error>(finished.error());
  if (*finished) verified_.insert(blob.digest);
  return {};
}

Result<void> BlobCache::receive(const BlobRef& blob, bool arrived_wrong, const std::atomic<bool>& stop,
                                PartialFile& partial) {
  if (auto ok = make_room(std::max(blob.bytes, partial.size()), partial.path()); !ok) return ok;
  const BlobRequest wanted{blob.digest, partial.size(), arrived_wrong};
  return fetch_(wanted, [&](std::span<const std::byte> bytes) -> Result<void> {
    if (stop) return fail(Errc::unavailable, "told to stop");
    const std::uint64_t size = partial.size() + bytes.size();
    if (blob.bytes != 0 && size > blob.bytes)
      return fail(Errc::invalid_argument,
                  fmt::format("'{}' is longer than the {} bytes announced", blob.name, blob.bytes));
    // The size of a canonical scene is not known in advance (bytes == 0), so room for it is made while it
    // arrives.
    if (blob.bytes == 0)
      if (auto ok = make_room(size, partial.path()); !ok) return ok;
    return partial.append(bytes);
  });
}

Result<void> BlobCache::make_room(std::uint64_t bytes, const fs::path& but) {
  if (limit_ == 0) return {};
  std::uint64_t total = bytes;
  // Files of unfinished transfers, which may be abandoned, are removed before complete blobs.
  std::vector<StoredFile> files = stored_partials(folder_);
  std::erase_if(files, [&](const StoredFile& file) { return file.path == but; });
  for (StoredFile& blob : stored_blobs(folder_)) files.push_back(std::move(blob));
  for (const StoredFile& file : files) total += file.bytes;
  for (const StoredFile& file : files) {
    if (total <= limit_) return {};
    if (!remove_unused(file.path)) continue;
    verified_.erase(file.digest);
    total -= file.bytes;
  }
  if (total <= limit_) return {};
  return fail(
      Errc::resource_exhausted,
      fmt::format("the cache is limited to {} bytes and what is in use leaves no room for {} more; raise "
                  "--cache-limit",
                  limit_, bytes));
}

std::vector<Digest> BlobCache::held(std::size_t limit) const {
  const std::vector<StoredFile> blobs = stored_blobs(folder_);
  std::vector<Digest> digests;
  for (auto it = blobs.rbegin(); it != blobs.rend() && digests.size() < limit; ++it)
    digests.push_back(it->digest);
  return digests;
}

}  // namespace ls::worker
