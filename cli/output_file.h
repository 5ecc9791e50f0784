// Writing what was asked for: whole or not at all.
#pragma once

#include <filesystem>
#include <span>
#include <string>

#include "common/base/error.h"

namespace ls::cli {

// Before hours of rendering: is there a folder that a file of this name can be in?
Result<void> check_output(const std::string& option, const std::filesystem::path& file);
Result<void> write_output(const std::filesystem::path& file, std::span<const std::byte> bytes);
Result<void> write_output(const std::filesystem::path& file, const std::string& text);

}  // namespace ls::cli
