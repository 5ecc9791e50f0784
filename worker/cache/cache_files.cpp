#include "worker/cache/cache_files.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <string>
#include <utility>

#include "core/base/spawn.h"

namespace ls::worker {
namespace fs = std::filesystem;
namespace {

constexpr std::size_t kDigestDigits = 64, kReadBytes = 1 << 20;

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
  const Descriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW));
  return file.fd >= 0 && lock_at(file.fd, path, LOCK_EX) == Lock::taken && ::unlink(path.c_str()) == 0;
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

tl::unexpected<Error> io_error(const std::string& what, const fs::path& path) {
  const int error = errno;
  const Errc code = error == ENOSPC || error == EDQUOT ? Errc::resource_exhausted : Errc::internal;
  return fail(code,
              fmt::format("{} {}: {}{}", what, path.string(), std::strerror(error),
                          code == Errc::resource_exhausted ? "; make room, or choose another --cache" : ""));
}

Result<PartialFile> PartialFile::open(const fs::path& path) {
  const int fd = ::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0600);
  if (fd < 0) return io_error("cannot write", path);
  PartialFile file(path, fd);
  // This process must not write to the file if another one has locked it, or has meanwhile moved it to its
  // final place.
  const Lock lock = lock_at(fd, path, LOCK_EX);
  if (lock == Lock::failed) return io_error("cannot lock", path);
  if (lock == Lock::lost) return open_own(path);
  if (auto ok = file.read_existing(); !ok) return tl::unexpected<Error>(ok.error());
  return file;
}

// Creates a file whose name is that of `path` with a random suffix. The process id as a suffix would not be
// unique, because workers in several containers may share the folder and have equal ids.
Result<PartialFile> PartialFile::open_own(const fs::path& path) {
  std::string name = path.string() + ".XXXXXX";
  const int fd = ::mkostemp(name.data(), O_CLOEXEC);
  if (fd < 0) return io_error("cannot write", name);
  PartialFile file(name, fd);
  const Lock lock = lock_at(fd, name, LOCK_EX);
  if (lock == Lock::failed) return io_error("cannot lock", name);
  if (lock == Lock::lost)
    return fail(Errc::unavailable, "another worker has cleaned up the cache folder just now");
  return file;
}

PartialFile::PartialFile(PartialFile&& other) noexcept
    : path_(std::move(other.path_)),
      fd_(std::exchange(other.fd_, -1)),
      size_(other.size_),
      hash_(std::move(other.hash_)) {}

PartialFile::~PartialFile() {
  if (fd_ >= 0) ::close(fd_);
}

Result<void> PartialFile::read_existing() {
  std::vector<std::byte> buffer(kReadBytes);
  while (true) {
    const ssize_t n = ::read(fd_, buffer.data(), buffer.size());
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) return io_error("cannot read", path_);
    if (n == 0) return {};
    hash_.update(std::span<const std::byte>(buffer.data(), static_cast<std::size_t>(n)));
    size_ += static_cast<std::uint64_t>(n);
  }
}

Result<void> PartialFile::append(std::span<const std::byte> bytes) {
  std::size_t done = 0;
  while (done < bytes.size()) {
    const ssize_t n = ::write(fd_, bytes.data() + done, bytes.size() - done);
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) return io_error("cannot write", path_);
    hash_.update(bytes.subspan(done, static_cast<std::size_t>(n)));
    size_ += static_cast<std::uint64_t>(n);
    done += static_cast<std::size_t>(n);
  }
  return {};
}

Result<bool> PartialFile::finish(const Digest& expected, const fs::path& place) {
  const Digest got = hash_.finish();
  if (got != expected) {
    discard();
    return fail(Errc::invalid_argument,
                fmt::format("received bytes with digest {} instead of {}", got.hex(), expected.hex()));
  }
  std::error_code error;
  fs::create_directories(place.parent_path(), error);
  if (::fdatasync(fd_) != 0) return io_error("cannot store", place);
  if (::renameat2(AT_FDCWD, path_.c_str(), AT_FDCWD, place.c_str(), RENAME_NOREPLACE) == 0) return true;
  if (errno == EEXIST) {  // another worker has created the file first
    discard();
    return false;
  }
  // EINVAL: the file system does not support RENAME_NOREPLACE.
  if (errno == EINVAL && ::rename(path_.c_str(), place.c_str()) == 0) return true;
  return io_error("cannot store", place);
}

void PartialFile::discard() { ::unlink(path_.c_str()); }

}  // namespace ls::worker
