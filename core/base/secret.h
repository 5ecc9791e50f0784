// Reads, writes and compares secrets, and signs texts with them.
#pragma once

#include <sys/types.h>

#include <filesystem>
#include <string>
#include <string_view>

#include "core/base/digest.h"
#include "core/base/error.h"

namespace ls {

// Returns true if the two are equal. The run time reveals neither the place of a difference nor the length of
// the secret.
bool equal_secret(std::string_view a, std::string_view b);
bool equal_secret(const Digest& a, const Digest& b);

// Returns the HMAC-SHA-256 (RFC 2104) of `text` as 64 lower-case hexadecimal digits.
std::string hmac_sha256(std::string_view key, std::string_view text);

// Reads the first word of a file, at most kSecretBytes of it. not_found: the file cannot be opened;
// invalid_argument: it has no word.
inline constexpr std::size_t kSecretBytes = 4096;
Result<std::string> read_secret(const std::filesystem::path& file);

// Reads a whole PEM file (certificates or a key) of at most kPemBytes. not_found: the file cannot be opened;
// invalid_argument: it is larger, or not PEM.
inline constexpr std::size_t kPemBytes = 1u << 20;
Result<std::string> read_pem(const std::filesystem::path& file);

// Replaces the file in one step: after a crash there is either the old file or the complete new one. The new
// file has the permissions `mode`.
Result<void> write_private(const std::filesystem::path& file, std::string_view text, mode_t mode = 0600);

}  // namespace ls
