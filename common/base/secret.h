// Secrets: reading and comparing them.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "common/base/error.h"

namespace ls {

// Equality whose run time tells neither where the texts differ nor how long the secret is.
bool equal_secret(std::string_view a, std::string_view b);

// The first word of a file, at most kSecretBytes of it.
inline constexpr std::size_t kSecretBytes = 4096;
Result<std::string> read_secret(const std::filesystem::path& file);

}  // namespace ls
