// Checks the size of an EXR attribute's value against its type. The library reads most types by their
// contents instead of the size in the header; if the two disagree it continues reading at a wrong place,
// where it may take any four bytes for the size of a buffer to allocate.
#pragma once

#include <cstddef>
#include <span>
#include <string_view>

namespace ls::exr {

// True if the library reads a value of this type from exactly these bytes. Always true for unknown types,
// whose bytes it just keeps.
bool fills_its_size(std::string_view type, std::span<const std::byte> value);

}  // namespace ls::exr
