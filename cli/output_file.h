// Writing what was asked for: whole or not at all.
#pragma once

#include <filesystem>
#include <span>
#include <string>

#include "common/base/error.h"

namespace ls::cli {

// Before hours of rendering: can a file of this name be written? Tries it with another file in its folder;
// the file itself is not touched.
Result<void> check_output(const std::string& option, const std::filesystem::path& file);
Result<void> check_folder(const std::string& option, const std::filesystem::path& folder);
Result<void> write_output(const std::filesystem::path& file, std::span<const std::byte> bytes);
Result<void> write_output(const std::filesystem::path& file, const std::string& text);
// Writes what must not be lost: if it cannot be written there, into the folder for temporary files. It is an
// error then, too, and says where it is.
Result<void> save_result(const std::filesystem::path& file, std::span<const std::byte> bytes);
Result<void> save_result(const std::filesystem::path& file, const std::string& text);

}  // namespace ls::cli
