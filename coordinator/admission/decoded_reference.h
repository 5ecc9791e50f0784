// Decodes a user's reference image in a process of its own. The coordinator must survive any file: the
// library that reads EXR files may crash, hang, or be taken over by one.
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>

#include "core/base/error.h"
#include "core/base/spawn.h"
#include "core/image/reference/reference.h"

namespace ls::coordinator {

// As read_reference() (core/image/reference/reference.h), but the file is decoded by the program
// lightshaft-exr, which is shut in by the sandbox of render children, ends after a minute, and may take
// 256 MB and 48 bytes for each pixel of limits.max_pixels. invalid_argument also: it needed more, or crashed.
// failed_precondition: the program is not installed beside this one.
Result<Reference> decode_reference(
    std::span<const std::byte> exr, FrameSize size, const ExrLimits& limits,
    const std::filesystem::path& program = program_beside_us("lightshaft-exr"));

}  // namespace ls::coordinator
