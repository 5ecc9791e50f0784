// Temporary files with what a request has sent, on the coordinator's disk.
#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <span>
#include <string_view>

#include "core/base/error.h"
#include "core/base/spawn.h"

namespace ls::http {

// Makes the error of a failed call, whose `errno` is `code`. A full disk is resource_exhausted, all else
// unavailable.
Error spool_error(std::string_view what, int code);

// Creates a file in `folder`, which is created if it is missing; an empty path means the system's folder for
// temporary files. The file has no name, so it disappears with its descriptor.
Result<std::unique_ptr<const Descriptor>> open_spool(const std::filesystem::path& folder);

// Appends all bytes to the file.
Result<void> write_spool(int fd, std::span<const std::byte> bytes);

}  // namespace ls::http
