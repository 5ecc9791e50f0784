// Certificates of a farm: an authority of its own, and what it signs. Keys are on P-256, signatures
// ECDSA-SHA256. Times are seconds since 1970.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "common/base/error.h"

namespace ls::tls {

struct Certificate {  // PEM
  std::string cert, key;
};

inline constexpr std::int64_t kDay = 86'400;
inline constexpr std::int64_t kAuthorityDays = 3650;
inline constexpr std::int64_t kDays = 397;  // of what it signs

Result<Certificate> make_authority(const std::string& common_name, std::int64_t now);

enum class Use { server, client };
struct Wanted {
  std::string common_name;
  Use use = Use::client;
  std::vector<std::string> names;  // host names and addresses it answers to; of a server
};
// invalid_argument: a name is none, or `authority` is no certificate with its key.
Result<Certificate> issue(const Certificate& authority, const Wanted& wanted, std::int64_t now);

// Whether it is signed by the authority and good for so much longer.
bool is_good(const std::string& cert, const std::string& authority, std::int64_t until);

}  // namespace ls::tls
