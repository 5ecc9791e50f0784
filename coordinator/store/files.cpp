#include "coordinator/store/files.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <system_error>

namespace ls::coordinator {

File::~File() {
  if (fd_ >= 0) ::close(fd_);
}

File& File::operator=(File&& other) noexcept {
  if (this != &other) {
    if (fd_ >= 0) ::close(fd_);
    fd_ = std::exchange(other.fd_, -1);
  }
  return *this;
}

Result<File> File::open(const std::filesystem::path& path, int flags, unsigned mode) {
  const int fd = ::open(path.c_str(), flags | O_CLOEXEC, mode);
  if (fd < 0) return tl::unexpected(errno_error("open", path));
  return File(fd);
}

Error errno_error(std::string_view what, const std::filesystem::path& path) {
  const int code = errno;
  const std::string reason = std::strerror(code);
  if (code == ENOSPC || code == EDQUOT || code == EFBIG)
    return {Errc::resource_exhausted,
            fmt::format("the disk is full: cannot {} {} ({}); free some space and try again", what,
                        path.string(), reason)};
  if (code == ENOENT) return {Errc::not_found, fmt::format("cannot {} {}: {}", what, path.string(), reason)};
  if (code == EACCES || code == EPERM || code == EROFS)
    return {Errc::permission_denied,
            fmt::format("cannot {} {}: {}; check the folder's owner and mode", what, path.string(), reason)};
  if (code == EMFILE || code == ENFILE)
    return {Errc::resource_exhausted,
            fmt::format("cannot {} {}: {}; raise `ulimit -n`", what, path.string(), reason)};
  return {Errc::unavailable, fmt::format("cannot {} {}: {}", what, path.string(), reason)};
}

Result<void> make_folder(const std::filesystem::path& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) {
    errno = error.value();
    return tl::unexpected(errno_error("make the folder", folder));
  }
  return {};
}

Result<void> write_all(const File& file, std::span<const std::byte> bytes,
                       const std::filesystem::path& path) {
  while (!bytes.empty()) {
    const ssize_t n = ::write(file.fd(), bytes.data(), bytes.size());
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) return tl::unexpected(errno_error("write", path));
    bytes = bytes.subspan(static_cast<std::size_t>(n));
  }
  return {};
}

Result<std::vector<std::byte>> read_at(const File& file, std::uint64_t offset, std::size_t length,
                                       const std::filesystem::path& path) {
  std::vector<std::byte> bytes(length);
  std::size_t have = 0;
  while (have < length) {
    const ssize_t n =
        ::pread(file.fd(), bytes.data() + have, length - have, static_cast<off_t>(offset + have));
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) return tl::unexpected(errno_error("read", path));
    if (n == 0)
      return fail(Errc::unavailable, fmt::format("{} ends at byte {}, {} were expected: the file is damaged",
                                                 path.string(), offset + have, offset + length));
    have += static_cast<std::size_t>(n);
  }
  return bytes;
}

Result<std::vector<std::byte>> read_file(const std::filesystem::path& path, std::uint64_t max_bytes) {
  auto file = File::open(path, O_RDONLY);
  if (!file) return tl::unexpected(file.error());
  struct stat info {};
  if (::fstat(file->fd(), &info) != 0) return tl::unexpected(errno_error("look at", path));
  if (static_cast<std::uint64_t>(info.st_size) > max_bytes)
    return fail(Errc::resource_exhausted, fmt::format("{} has {} bytes, more than the {} allowed here",
                                                      path.string(), info.st_size, max_bytes));
  return read_at(*file, 0, static_cast<std::size_t>(info.st_size), path);
}

Result<void> sync_data(const File& file, const std::filesystem::path& path) {
  if (::fdatasync(file.fd()) != 0) return tl::unexpected(errno_error("sync", path));
  return {};
}

Result<void> sync_folder(const std::filesystem::path& folder) {
  auto file = File::open(folder, O_RDONLY | O_DIRECTORY);
  if (!file) return tl::unexpected(file.error());
  if (::fsync(file->fd()) != 0) return tl::unexpected(errno_error("sync", folder));
  return {};
}

Result<std::vector<std::filesystem::path>> list_folder(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> paths;
  std::error_code error;
  for (std::filesystem::directory_iterator at(folder, error), end; !error && at != end; at.increment(error))
    paths.push_back(at->path());
  if (error)
    return fail(Errc::unavailable, fmt::format("cannot list '{}': {}", folder.string(), error.message()));
  return paths;
}

Result<AtomicFile> AtomicFile::create(std::filesystem::path path, std::string_view suffix, unsigned mode) {
  std::filesystem::path temporary = path.string() + std::string(suffix);
  auto file = File::open(temporary, O_WRONLY | O_CREAT | O_TRUNC, mode);
  if (!file) return tl::unexpected(file.error());
  return AtomicFile(std::move(path), std::move(temporary), std::move(*file));
}

AtomicFile::~AtomicFile() {
  if (file_) ::unlink(temporary_.c_str());
}

Result<void> AtomicFile::write(std::span<const std::byte> bytes) {
  return write_all(file_, bytes, temporary_);
}

Result<void> AtomicFile::write_at(std::uint64_t offset, std::span<const std::byte> bytes) {
  while (!bytes.empty()) {
    const ssize_t n = ::pwrite(file_.fd(), bytes.data(), bytes.size(), static_cast<off_t>(offset));
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) return tl::unexpected(errno_error("write", temporary_));
    bytes = bytes.subspan(static_cast<std::size_t>(n));
    offset += static_cast<std::uint64_t>(n);
  }
  return {};
}

Result<void> AtomicFile::sync() {
  if (::fsync(file_.fd()) != 0) return tl::unexpected(errno_error("sync", temporary_));
  return {};
}

Result<void> AtomicFile::commit() {
  if (auto synced = sync(); !synced) return synced;
  if (auto renamed = commit_unsynced(); !renamed) return renamed;
  return sync_folder(path_.parent_path());
}

Result<void> AtomicFile::commit_unsynced() {
  if (::rename(temporary_.c_str(), path_.c_str()) != 0)
    return tl::unexpected(errno_error("rename to", path_));
  file_ = File();
  return {};
}

Result<void> write_atomically(const std::filesystem::path& path, std::span<const std::byte> bytes,
                              unsigned mode) {
  auto file = AtomicFile::create(path, ".tmp", mode);
  if (!file) return tl::unexpected(file.error());
  if (auto written = file->write(bytes); !written) return written;
  return file->commit();
}

Result<File> lock_folder(const std::filesystem::path& folder) {
  const auto path = folder / "store.lock";
  auto file = File::open(path, O_RDWR | O_CREAT);
  if (!file) return file;
  if (::flock(file->fd(), LOCK_EX | LOCK_NB) != 0) {
    if (errno != EWOULDBLOCK) return tl::unexpected(errno_error("lock", path));
    return fail(
        Errc::failed_precondition,
        fmt::format("another coordinator is using {}; stop it, or give this one a --data folder of its own",
                    folder.string()));
  }
  return file;
}

}  // namespace ls::coordinator
