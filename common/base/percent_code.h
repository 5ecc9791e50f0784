// The percent codes of URLs.
#pragma once

#include <fmt/format.h>

#include <cctype>
#include <charconv>
#include <optional>
#include <string>
#include <string_view>

namespace ls {

// "a b" -> "a%20b": codes all but the unreserved characters.
inline std::string percent_encode(std::string_view text) {
  std::string out;
  for (const unsigned char c : text)
    if (std::isalnum(c) != 0 || c == '-' || c == '_' || c == '.' || c == '~')
      out += static_cast<char>(c);
    else
      out += fmt::format("%{:02X}", c);
  return out;
}

// "a%20b" -> "a b" (RFC 3986, section 2.1); nullopt if a '%' is not followed by two hexadecimal digits.
inline std::optional<std::string> percent_decode(std::string_view text) {
  std::string out;
  while (!text.empty()) {
    const char* const code = text.data() + 1;
    const bool coded = text.front() == '%';
    unsigned char byte = static_cast<unsigned char>(text.front());
    if (coded && (text.size() < 3 || std::from_chars(code, code + 2, byte, 16).ptr != code + 2)) return {};
    out += static_cast<char>(byte);
    text.remove_prefix(coded ? 3 : 1);
  }
  return out;
}

}  // namespace ls
