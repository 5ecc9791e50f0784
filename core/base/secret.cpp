#include "core/base/secret.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <openssl/crypto.h>
#include <openssl/evp.h>
#include <openssl/hmac.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <iomanip>

#include "core/base/spawn.h"

namespace ls {

bool equal_secret(std::string_view a, std::string_view b) {
  // Compares the SHA-256 digests of the secrets: they have equal length, and an attacker cannot predict them,
  // so the time of the comparison reveals nothing about the secrets.
  return equal_secret(sha256(a), sha256(b));
}

bool equal_secret(const Digest& a, const Digest& b) {
  return CRYPTO_memcmp(a.bytes.data(), b.bytes.data(), a.bytes.size()) == 0;
}

std::string hmac_sha256(std::string_view key, std::string_view text) {
  Digest mac;
  unsigned int length = 0;
  // HMAC() fails only if memory runs out. The result is then empty: no signature is better than a weak one.
  if (!HMAC(EVP_sha256(), key.data(), static_cast<int>(key.size()),
            reinterpret_cast<const unsigned char*>(text.data()), text.size(),
            reinterpret_cast<unsigned char*>(mac.bytes.data()), &length))
    return "";
  return mac.hex();
}

Result<std::string> read_secret(const std::filesystem::path& file) {
  std::ifstream in(file);
  std::string secret;
  if (!in) return fail(Errc::not_found, fmt::format("{} cannot be opened", file.string()));
  if (!(in >> std::setw(static_cast<int>(kSecretBytes)) >> secret))
    return bad_argument(fmt::format("{} has no token in it", file.string()));
  return secret;
}

Result<std::string> read_pem(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  if (!in) return fail(Errc::not_found, fmt::format("{} cannot be opened", file.string()));
  std::string text(kPemBytes + 1, '\0');
  in.read(text.data(), static_cast<std::streamsize>(text.size()));
  text.resize(static_cast<std::size_t>(in.gcount()));
  if (text.size() > kPemBytes || text.find("-----BEGIN ") == std::string::npos)
    return bad_argument(fmt::format("{} is no PEM file", file.string()));
  return text;
}

Result<void> write_private(const std::filesystem::path& file, std::string_view text, mode_t mode) {
  const std::string aside = file.string() + ".new";
  ::unlink(aside.c_str());
  const Descriptor out{::open(aside.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, mode)};
  if (out.fd < 0 || ::write(out.fd, text.data(), text.size()) != static_cast<ssize_t>(text.size()) ||
      ::fsync(out.fd) != 0 || ::rename(aside.c_str(), file.c_str()) != 0)
    return fail(Errc::resource_exhausted,
                fmt::format("cannot write '{}': {}", file.string(), std::strerror(errno)));
  return {};
}

}  // namespace ls
