// Certificates of a farm: its own certificate authority, and the certificates that it signs. Keys are on
// P-256, signatures ECDSA-SHA256. Times are seconds since 1970.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "common/base/error.h"

namespace ls::tls {

struct Certificate {  // texts in PEM format
  std::string cert, key;
};

inline constexpr std::int64_t kDay = 86'400;
inline constexpr std::int64_t kAuthorityDays = 3650;
inline constexpr std::int64_t kDays = 397;  // validity of issued certificates, in days

// Makes a new certificate authority, valid for kAuthorityDays from `now` on.
Result<Certificate> make_authority(const std::string& common_name, std::int64_t now);

enum class Use { server, client };
struct Wanted {
  std::string common_name;
  Use use = Use::client;
  std::vector<std::string> names;  // only for a server: its host names and addresses
};
// Makes a key and a certificate for it, signed by `authority` and valid for kDays. invalid_argument: a name
// is invalid, or `authority` is not a certificate with its key.
Result<Certificate> issue(const Certificate& authority, const Wanted& wanted, std::int64_t now);

// True if `cert` was signed by `authority` and is valid at least until the time `until`.
bool is_good(const std::string& cert, const std::string& authority, std::int64_t until);

}  // namespace ls::tls
