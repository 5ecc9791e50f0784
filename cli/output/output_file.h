// Writes output files completely or not at all.
#pragma once

#include <filesystem>
#include <span>
#include <string>

#include "common/base/error.h"
#include "common/base/frame_range.h"

namespace ls::cli {

// Checks before a long render that a file of this name can be written, by creating and removing another file
// in its folder; the file itself is not touched. `option` is the command line option that names the file, for
// messages.
Result<void> check_output(const std::string& option, const std::filesystem::path& file);
Result<void> check_folder(const std::string& option, const std::filesystem::path& folder);
// Checks the name of an output file that is written once per frame. invalid_argument: there are several
// frames, and the name has no # to distinguish their files.
Result<void> check_numbered(const std::string& option, const std::string& name, const FrameRange& frames);
Result<void> write_output(const std::filesystem::path& file, std::span<const std::byte> bytes);
Result<void> write_output(const std::filesystem::path& file, const std::string& text);
// Writes a result that must not be lost. If it cannot be written to `file`, it is written to a new file in
// the folder for temporary files, and the returned error names that file.
Result<void> save_result(const std::filesystem::path& file, std::span<const std::byte> bytes);
Result<void> save_result(const std::filesystem::path& file, const std::string& text);

}  // namespace ls::cli
