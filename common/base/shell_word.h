// Text as one word of a command that a person copies into a shell.
#pragma once

#include <string>
#include <string_view>

namespace ls {

// As it is where no shell sees more in it; else in quotes. Control characters are written as escapes ($'...',
// as bash, zsh and ksh read them): the word can stand on a terminal and in a log line.
std::string shell_word(std::string_view text);

}  // namespace ls
