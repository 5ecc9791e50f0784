#include "common/base/secret.h"

#include <fmt/format.h>
#include <openssl/crypto.h>

#include <fstream>
#include <iomanip>

#include "common/base/digest.h"

namespace ls {

bool equal_secret(std::string_view a, std::string_view b) {
  const Digest x = sha256(a), y = sha256(b);  // of one length, and unpredictable to who guesses
  return CRYPTO_memcmp(x.bytes.data(), y.bytes.data(), x.bytes.size()) == 0;
}

Result<std::string> read_secret(const std::filesystem::path& file) {
  std::ifstream in(file);
  std::string secret;
  if (!in) return fail(Errc::not_found, fmt::format("{} cannot be opened", file.string()));
  if (!(in >> std::setw(static_cast<int>(kSecretBytes)) >> secret))
    return fail(Errc::invalid_argument, fmt::format("{} has no token in it", file.string()));
  return secret;
}

}  // namespace ls
