#include "worker/cache/partial_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <utility>
#include <vector>

#include "worker/cache/stored.h"

namespace ls::worker {
namespace {

constexpr std::size_t kReadBytes = 1 << 20;

}  // namespace

tl::unexpected<Error> io_error(const std::string& what, const std::filesystem::path& path) {
  const int error = errno;
  const Errc code = error == ENOSPC || error == EDQUOT ? Errc::resource_exhausted : Errc::internal;
  return fail(code,
              fmt::format("{} {}: {}{}", what, path.string(), std::strerror(error),
                          code == Errc::resource_exhausted ? "; make room, or choose another --cache" : ""));
}

Result<PartialFile> PartialFile::open(const std::filesystem::path& path) {
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
Result<PartialFile> PartialFile::open_own(const std::filesystem::path& path) {
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

Result<bool> PartialFile::finish(const Digest& expected, const std::filesystem::path& place) {
  const Digest got = hash_.finish();
  if (got != expected) {
    discard();
    return fail(Errc::invalid_argument,
                fmt::format("received bytes with digest {} instead of {}", got.hex(), expected.hex()));
  }
  std::error_code error;
  std::filesystem::create_directories(place.parent_path(), error);
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
