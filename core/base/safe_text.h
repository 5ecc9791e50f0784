// Makes external text (a scene, a farm's answer) safe for a terminal, a shell or a URL.
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace ls {

// Replaces each character that could move the cursor, colour the terminal, forge lines or reorder letters by
// one space, so that columns stay aligned. These are control characters (C0, DEL, C1, also single bytes that
// are not UTF-8), line and paragraph separators, and directional marks and overrides.
std::string plain_text(std::string_view text);
// The same for each line of the text: line feeds stay.
std::string plain_lines(std::string_view text);

// Quotes `text` as one word of a shell command, which a person can copy: returns it unchanged if none of its
// characters has a special meaning in a shell, otherwise quoted. Control characters are written as escapes
// ($'...', as bash, zsh and ksh read them), so the word can be shown on a terminal and in a log line.
std::string shell_word(std::string_view text);

// Encodes all but the unreserved characters of URLs: "a b" -> "a%20b".
std::string percent_encode(std::string_view text);
// Decodes a text of percent_encode() or of a URL: "a%20b" -> "a b" (RFC 3986, section 2.1). nullopt: a '%' is
// not followed by two hexadecimal digits.
std::optional<std::string> percent_decode(std::string_view text);

}  // namespace ls
