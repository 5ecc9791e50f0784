// Writes output files completely or not at all.
#pragma once

#include <filesystem>
#include <span>
#include <string>

#include "common/base/error.h"
#include "common/base/frame_range.h"

namespace ls::cli {

// Checks before a long render that a file of this name can be written, by creating another file in its
// folder; the file itself is not touched.
Result<void> check_output(const std::string& option, const std::filesystem::path& file);
Result<void> check_folder(const std::string& option, const std::filesystem::path& folder);
// Checks the name for the files of a sequence. invalid_argument: several frames, and no # in the name to
// distinguish them.
Result<void> check_numbered(const std::string& option, const std::string& name, const FrameRange& frames);
Result<void> write_output(const std::filesystem::path& file, std::span<const std::byte> bytes);
Result<void> write_output(const std::filesystem::path& file, const std::string& text);
// Writes a result that must not be lost: if it cannot be written to its place, writes it to the folder for
// temporary files. That also returns an error, which says where it is.
Result<void> save_result(const std::filesystem::path& file, std::span<const std::byte> bytes);
Result<void> save_result(const std::filesystem::path& file, const std::string& text);

}  // namespace ls::cli
