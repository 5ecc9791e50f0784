// Writing what was asked for: whole or not at all.
#pragma once

#include <filesystem>
#include <span>
#include <string>

#include "common/base/error.h"
#include "common/base/frame_range.h"

namespace ls::cli {

// Before hours of rendering: can a file of this name be written? Tries it with another file in its folder;
// the file itself is not touched.
Result<void> check_output(const std::string& option, const std::filesystem::path& file);
Result<void> check_folder(const std::string& option, const std::filesystem::path& folder);
// The name of one frame's file. invalid_argument: several frames, and no # in the name to tell them apart.
Result<void> check_numbered(const std::string& option, const std::string& name, const FrameRange& frames);
Result<void> write_output(const std::filesystem::path& file, std::span<const std::byte> bytes);
Result<void> write_output(const std::filesystem::path& file, const std::string& text);
// Writes what must not be lost: if it cannot be written there, into the folder for temporary files. It is an
// error then, too, and says where it is.
Result<void> save_result(const std::filesystem::path& file, std::span<const std::byte> bytes);
Result<void> save_result(const std::filesystem::path& file, const std::string& text);

}  // namespace ls::cli
