#include "coordinator/http/bundle/spool.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <stdlib.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <string>
#include <system_error>

namespace ls::http {

Error spool_error(std::string_view what, int code) {
  const bool full = code == ENOSPC || code == EDQUOT || code == EFBIG;
  return {full ? Errc::resource_exhausted : Errc::unavailable,
          fmt::format("{} for the files of the request: {}{}", what, std::strerror(code),
                      full ? "; free some space on the coordinator's disk and send it again" : "")};
}

Result<std::unique_ptr<const Descriptor>> open_spool(const std::filesystem::path& folder) {
  std::error_code error;
  const auto place = folder.empty() ? std::filesystem::temp_directory_path(error) : folder;
  if (!error) std::filesystem::create_directories(place, error);
  if (error) return tl::unexpected(spool_error("no folder", error.value()));
  std::string name = (place / "body-XXXXXX").string();
  auto file = std::make_unique<const Descriptor>(::mkostemp(name.data(), O_CLOEXEC));
  if (file->fd < 0) return tl::unexpected(spool_error("no file", errno));
  ::unlink(name.c_str());
  return file;
}

Result<void> write_spool(int fd, std::span<const std::byte> bytes) {
  while (!bytes.empty()) {
    const ssize_t n = ::write(fd, bytes.data(), bytes.size());
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) return tl::unexpected(spool_error("no room", errno));
    bytes = bytes.subspan(static_cast<std::size_t>(n));
  }
  return {};
}

}  // namespace ls::http
