// Reading and comparing secrets.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "common/base/digest.h"
#include "common/base/error.h"

namespace ls {

// Equality whose run time reveals neither where the texts differ nor the secret's length.
bool equal_secret(std::string_view a, std::string_view b);
bool equal_secret(const Digest& a, const Digest& b);

// HMAC-SHA-256 (RFC 2104) as 64 lower-case hexadecimal digits.
std::string hmac_sha256(std::string_view key, std::string_view text);

// The first word of a file, at most kSecretBytes of it.
inline constexpr std::size_t kSecretBytes = 4096;
Result<std::string> read_secret(const std::filesystem::path& file);

// A whole PEM file, certificates or a key, of at most kPemBytes. invalid_argument: not PEM.
inline constexpr std::size_t kPemBytes = 1u << 20;
Result<std::string> read_pem(const std::filesystem::path& file);

}  // namespace ls
