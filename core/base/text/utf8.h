// Finds what text of strangers must not contain: bytes that are not UTF-8, and control characters.
#pragma once

#include <cstddef>
#include <string_view>

namespace ls {

// Returns the offset of the first byte that is not well-formed UTF-8; npos if there is none.
std::size_t find_invalid_utf8(std::string_view text);
// Returns the offset of the first control character in well-formed UTF-8 (below U+0020 except tabs and line
// ends, U+007F to U+009F); npos if there is none.
std::size_t find_control(std::string_view text);
// True if the byte continues a UTF-8 character.
inline bool is_continuation(char c) { return (static_cast<unsigned char>(c) & 0xC0) == 0x80; }

}  // namespace ls
