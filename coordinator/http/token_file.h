// Secrets kept in the data folder: one line, 256 random bits in hexadecimal, readable by its owner only.
#pragma once

#include <filesystem>
#include <string>

#include "common/base/error.h"

namespace ls::http {

// The secret in `file`; made (mode 0600) if there is none yet. A file that others may read, or that holds
// fewer than 16 characters, is refused. The caller holds the data folder's lock: two starts don't race here.
Result<std::string> read_or_make_token(const std::filesystem::path& file);

}  // namespace ls::http
