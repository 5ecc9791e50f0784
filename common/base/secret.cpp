#include "common/base/secret.h"

#include <openssl/crypto.h>

#include "common/base/digest.h"

namespace ls {

bool equal_secret(std::string_view a, std::string_view b) {
  const Digest x = sha256(a), y = sha256(b);  // of one length, and unpredictable to who guesses
  return CRYPTO_memcmp(x.bytes.data(), y.bytes.data(), x.bytes.size()) == 0;
}

}  // namespace ls
