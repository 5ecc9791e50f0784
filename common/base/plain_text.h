// Text from elsewhere (a scene, a farm's answer) on its way to a terminal.
#pragma once

#include <string>
#include <string_view>

namespace ls {

// The text without what could move the cursor, colour the terminal, forge lines or show letters in another
// order: each control character (C0, DEL, C1, also as single bytes of no UTF-8), line and paragraph separator
// and directional override becomes one space, so that columns stay.
std::string plain_text(std::string_view text);

}  // namespace ls
