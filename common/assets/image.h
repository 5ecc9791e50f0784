// PNG, JPEG, OpenEXR and Radiance HDR, told apart by their first bytes.
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string_view>

#include "common/assets/data.h"

namespace ls {

Result<ImageData> decode_image(std::string_view name, std::span<const std::byte> file);
Result<ImageData> load_image(const std::filesystem::path& path, std::string_view name);

// One a format, for tests and for callers that know.
Result<ImageData> decode_png(std::string_view name,
                             std::span<const std::byte> file);  // 1..16 bits, palette, alpha
Result<ImageData> decode_jpeg(std::string_view name,
                              std::span<const std::byte> file);  // grey or colour, 8 bits
Result<ImageData> decode_exr(std::string_view name,
                             std::span<const std::byte> file);  // R G B A, or Y; half and float
Result<ImageData> decode_hdr(std::string_view name, std::span<const std::byte> file);  // RGBE

}  // namespace ls
