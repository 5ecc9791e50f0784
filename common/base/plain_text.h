// Makes external text (a scene, a farm's answer) safe for a terminal.
#pragma once

#include <string>
#include <string_view>

namespace ls {

// Replaces characters that could move the cursor, colour the terminal, forge lines or reorder letters. Each
// control character (C0, DEL, C1, also single bytes that are not UTF-8), line and paragraph separator and
// directional override becomes one space, so that columns are kept.
std::string plain_text(std::string_view text);

}  // namespace ls
