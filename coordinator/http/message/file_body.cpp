#include "coordinator/http/message/file_body.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

namespace ls::http {

Result<FileBody> open_file_body(const std::filesystem::path& path) {
  const int opened = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (opened < 0)
    return fail(errno == ENOENT ? Errc::not_found : Errc::unavailable,
                fmt::format("cannot open {}: {}", path.string(), std::strerror(errno)));
  const std::shared_ptr<const int> fd(new int(opened), [](const int* owned) {
    ::close(*owned);
    delete owned;
  });
  struct stat info {};
  if (::fstat(*fd, &info) != 0)
    return fail(Errc::unavailable, fmt::format("cannot look at {}: {}", path.string(), std::strerror(errno)));
  return FileBody{fd, static_cast<std::uint64_t>(info.st_size)};
}

std::size_t read_slice(const FileBody& file, std::uint64_t offset, std::span<std::byte> into) {
  ssize_t n = -1;
  do n = ::pread(*file.fd, into.data(), into.size(), static_cast<off_t>(offset));
  while (n < 0 && errno == EINTR);
  return n < 0 ? 0 : static_cast<std::size_t>(n);
}

}  // namespace ls::http
