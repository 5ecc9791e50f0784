#include "coordinator/http/auth/token_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <openssl/rand.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>

#include "common/base/digest.h"
#include "common/base/secret.h"

namespace ls::http {
namespace {

constexpr std::size_t kMinToken = 16, kMaxToken = 1024;
constexpr std::size_t kMaxList = 1u << 20;

std::string why() { return std::strerror(errno); }

Result<std::string> read_token(int fd, const std::filesystem::path& file) {
  struct stat info {};
  if (::fstat(fd, &info) != 0)
    return fail(Errc::internal, fmt::format("cannot stat '{}': {}", file.string(), why()));
  if ((info.st_mode & 077) != 0)
    return fail(Errc::failed_precondition,
                fmt::format("'{}' may be read by others: chmod 600 it, or delete it to get a new one",
                            file.string()));
  std::array<char, kMaxToken + 1> buffer{};
  const ssize_t n = ::read(fd, buffer.data(), buffer.size());
  if (n < 0) return fail(Errc::internal, fmt::format("cannot read '{}': {}", file.string(), why()));
  std::string token(buffer.data(), static_cast<std::size_t>(n));
  while (!token.empty() && static_cast<unsigned char>(token.back()) <= ' ') token.pop_back();
  if (token.size() < kMinToken || token.size() > kMaxToken)
    return fail(Errc::failed_precondition,
                fmt::format("'{}' holds no token of {} to {} characters: delete it to get a "
                            "new one",
                            file.string(), kMinToken, kMaxToken));
  return token;
}

Result<std::string> make_token(const std::filesystem::path& file) {
  auto token = random_token();
  if (!token) return token;
  if (auto written = write_private(file, *token + "\n"); !written) return tl::unexpected(written.error());
  return token;
}

}  // namespace

Result<std::string> read_or_make_token(const std::filesystem::path& file) {
  const Descriptor in{::open(file.c_str(), O_RDONLY | O_CLOEXEC)};
  if (in.fd >= 0) return read_token(in.fd, file);
  if (errno != ENOENT)
    return fail(Errc::failed_precondition, fmt::format("cannot open '{}': {}", file.string(), why()));
  return make_token(file);
}

Result<std::string> random_token() {
  Digest random;
  if (RAND_bytes(random.bytes.data(), static_cast<int>(random.bytes.size())) != 1)
    return fail(Errc::internal, "the system's random numbers failed");
  return random.hex();
}

Result<std::string> read_list(const std::filesystem::path& file) {
  const Descriptor in{::open(file.c_str(), O_RDONLY | O_CLOEXEC)};
  if (in.fd < 0 && errno == ENOENT) return std::string();
  struct stat info {};
  if (in.fd < 0 || ::fstat(in.fd, &info) != 0)
    return fail(Errc::failed_precondition, fmt::format("cannot open '{}': {}", file.string(), why()));
  if ((info.st_mode & 022) != 0)
    return fail(Errc::failed_precondition,
                fmt::format("'{}' may be written by others: chmod go-w it", file.string()));
  std::string text(kMaxList + 1, '\0');
  std::size_t size = 0;
  while (size < text.size()) {
    const ssize_t n = ::read(in.fd, text.data() + size, text.size() - size);
    if (n < 0) return fail(Errc::internal, fmt::format("cannot read '{}': {}", file.string(), why()));
    if (n == 0) break;
    size += static_cast<std::size_t>(n);
  }
  if (size > kMaxList)
    return fail(Errc::failed_precondition,
                fmt::format("'{}' has more than {} bytes", file.string(), kMaxList));
  text.resize(size);
  return text;
}

FileState file_state(const std::filesystem::path& file) {
  struct stat info {};
  if (::stat(file.c_str(), &info) != 0) return {};
  return {static_cast<std::uint64_t>(info.st_ino), static_cast<std::uint64_t>(info.st_size),
          std::int64_t{info.st_mtim.tv_sec} * 1'000'000'000 + info.st_mtim.tv_nsec};
}

FolderLock::FolderLock(const std::filesystem::path& folder)
    : file_(folder.empty() ? -1
                           : ::open((folder / "secrets.lock").c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600)) {
  while (file_.fd >= 0 && ::flock(file_.fd, LOCK_EX) != 0 && errno == EINTR) continue;
}

}  // namespace ls::http
