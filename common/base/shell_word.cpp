#include "common/base/shell_word.h"

#include <fmt/format.h>

#include <algorithm>

#include "common/base/plain_text.h"

namespace ls {
namespace {

bool plain(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
         std::string_view("%+,-./:=@_").find(c) != std::string_view::npos;
}

}  // namespace

std::string shell_word(std::string_view text) {
  if (!text.empty() && std::all_of(text.begin(), text.end(), plain)) return std::string(text);
  // True if there are characters that are unsafe for a terminal
  const bool escapes = plain_text(text) != text;
  std::string word = escapes ? "$'" : "'";
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (!escapes)
      c == '\'' ? word.append("'\\''") : word.append(1, c);
    else if (c == '\'' || c == '\\')
      word.append(1, '\\').append(1, c);
    else if (byte < 0x20 || byte >= 0x7f)
      word += fmt::format("\\{:03o}", byte);
    else
      word += c;
  }
  return word + "'";
}

}  // namespace ls
