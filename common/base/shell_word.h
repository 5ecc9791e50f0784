// Quotes text as one word of a shell command, which a person can copy.
#pragma once

#include <string>
#include <string_view>

namespace ls {

// Returns `text` unchanged if none of its characters has a special meaning in a shell, otherwise quoted.
// Control characters are written as escapes ($'...', as bash, zsh and ksh read them), so the word can be
// shown on a terminal and in a log line.
std::string shell_word(std::string_view text);

}  // namespace ls
