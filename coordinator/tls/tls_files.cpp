#include "coordinator/tls/tls_files.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>

#include "common/base/secret.h"
#include "common/base/spawn.h"
#include "coordinator/tls/certificates.h"

namespace ls::tls {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMaxBytes = 1u << 20;
constexpr std::int64_t kRenewBefore = 30 * kDay;

tl::unexpected<Error> wrong(const fs::path& file, const std::string& why) {
  return fail(Errc::invalid_argument, fmt::format("'{}' {}", file.string(), why));
}

}  // namespace

bool kept_secret(unsigned owner, unsigned mode, unsigned reader) {
  return (mode & 077) == 0 || (owner == 0 && reader != 0 && (mode & 037) == 0);
}

namespace {

Result<std::string> read_pem(const fs::path& file, bool secret) {
  const Descriptor in{::open(file.c_str(), O_RDONLY | O_CLOEXEC)};
  struct stat info {};
  if (in.fd < 0 || ::fstat(in.fd, &info) != 0)
    return wrong(file, fmt::format("cannot be read: {}", std::strerror(errno)));
  if (secret && !kept_secret(info.st_uid, info.st_mode, ::geteuid()))
    return wrong(file, "is a key that others may read: chmod 600 it");
  std::string text;
  std::array<char, 4096> buffer{};
  while (true) {
    const ssize_t n = ::read(in.fd, buffer.data(), buffer.size());
    if (n < 0) return wrong(file, fmt::format("cannot be read: {}", std::strerror(errno)));
    if (n == 0) return text;
    text.append(buffer.data(), static_cast<std::size_t>(n));
    if (text.size() > kMaxBytes) return wrong(file, "is too large to be a certificate or a key");
  }
}

Result<void> write_pair(const fs::path& folder, const std::string& name, const Certificate& pair) {
  if (auto done = write_private(folder / (name + ".key"), pair.key); !done) return done;
  return write_private(folder / (name + ".pem"), pair.cert, 0644);
}

Result<Certificate> authority_of(const fs::path& folder, std::int64_t now) {
  const bool cert = fs::exists(folder / "ca.pem"), key = fs::exists(folder / "ca.key");
  if (!cert) {  // made even if there is a key: the last start may have ended before it wrote the certificate
    auto made = make_authority("Lightshaft farm", now);
    if (!made) return made;
    if (auto done = write_pair(folder, "ca", *made); !done) return tl::unexpected(done.error());
    return made;
  }
  if (!key)
    return wrong(
        folder / "ca.key",
        "is missing beside ca.pem: put it back, or give certificates of your own with --tls-cert, "
        "--tls-key and --tls-ca, or delete the folder (then all workers and users need the new ca.pem)");
  auto ca = read_pem(folder / "ca.pem", false);
  if (!ca) return tl::unexpected(ca.error());
  auto ca_key = read_pem(folder / "ca.key", true);
  if (!ca_key) return tl::unexpected(ca_key.error());
  return Certificate{std::move(*ca), std::move(*ca_key)};
}

std::string host_name() {
  std::array<char, 256> name{};
  return ::gethostname(name.data(), name.size() - 1) == 0 ? name.data() : "";
}

}  // namespace

Result<Texts> read_files(const fs::path& ca, const fs::path& cert, const fs::path& key) {
  auto own_ca = read_pem(ca, false);
  if (!own_ca) return tl::unexpected(own_ca.error());
  auto own_cert = read_pem(cert, false);
  if (!own_cert) return tl::unexpected(own_cert.error());
  auto own_key = read_pem(key, true);
  if (!own_key) return tl::unexpected(own_key.error());
  return Texts{std::move(*own_ca), std::move(*own_cert), std::move(*own_key)};
}

Result<Texts> make_files(const fs::path& folder, std::vector<std::string> names, std::int64_t now) {
  if (::mkdir(folder.c_str(), 0700) != 0 && errno != EEXIST)
    return fail(Errc::resource_exhausted,
                fmt::format("cannot make '{}': {}", folder.string(), std::strerror(errno)));
  const auto authority = authority_of(folder, now);
  if (!authority) return tl::unexpected(authority.error());
  for (const std::string& own :
       {std::string("localhost"), std::string("127.0.0.1"), std::string("::1"), host_name()})
    if (!own.empty()) names.push_back(own);
  const auto server = issue(*authority, {"coordinator", Use::server, std::move(names)}, now);
  if (!server) return tl::unexpected(server.error());
  if (auto done = write_pair(folder, "server", *server); !done) return tl::unexpected(done.error());
  const auto old = read_pem(folder / "worker.pem", false);
  if (!old || !is_good(*old, authority->cert, now + kRenewBefore)) {
    const auto worker = issue(*authority, {"worker", Use::client, {}}, now);
    if (!worker) return tl::unexpected(worker.error());
    if (auto done = write_pair(folder, "worker", *worker); !done) return tl::unexpected(done.error());
  }
  return Texts{authority->cert, server->cert, server->key};
}

}  // namespace ls::tls
