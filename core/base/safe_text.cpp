#include "core/base/safe_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cstddef>
#include <cstdint>
#include <optional>

namespace ls {
namespace {

struct Character {
  std::uint32_t code = 0;
  std::size_t bytes = 0;
};

// Returns the UTF-8 character at the start of the text; nullopt if the bytes are not UTF-8.
std::optional<Character> first_character(std::string_view text) {
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
  const std::uint32_t lead = byte(0);
  if (lead < 0x80) return Character{lead, 1};
  const std::size_t length = lead >= 0xF0 ? 4 : lead >= 0xE0 ? 3 : 2;
  if (lead < 0xC2 || lead > 0xF4 || text.size() < length) return std::nullopt;
  std::uint32_t code = lead & (0xFFu >> (length + 1));
  for (std::size_t i = 1; i < length; ++i) {
    if ((byte(i) & 0xC0) != 0x80) return std::nullopt;
    code = code << 6 | (byte(i) & 0x3F);
  }
  return Character{code, length};
}

bool is_shown(std::uint32_t code) {
  const auto within = [code](std::uint32_t first, std::uint32_t last) {
    return code >= first && code <= last;
  };
  // These are not shown: control characters; directional marks (0x061C, 0x200E, 0x200F); line and paragraph
  // separators, directional embeddings and overrides (together 0x2028 to 0x202E); directional isolates.
  return !within(0, 0x1F) && !within(0x7F, 0x9F) && code != 0x061C && !within(0x200E, 0x200F) &&
         !within(0x2028, 0x202E) && !within(0x2066, 0x2069);
}

bool needs_no_quotes(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
         std::string_view("%+,-./:=@_").find(c) != std::string_view::npos;
}

}  // namespace

std::string plain_text(std::string_view text) {
  std::string plain;
  plain.reserve(text.size());
  while (!text.empty()) {
    const auto character = first_character(text);
    const std::size_t bytes = character ? character->bytes : 1;
    if (character ? is_shown(character->code) : static_cast<unsigned char>(text[0]) > 0x9F)
      plain += text.substr(0, bytes);
    else
      plain += ' ';
    text.remove_prefix(bytes);
  }
  return plain;
}

std::string plain_lines(std::string_view text) {
  std::string plain;
  for (;;) {
    const std::size_t end = text.find('\n');
    plain += plain_text(text.substr(0, end));
    if (end == std::string_view::npos) return plain;
    plain += '\n';
    text.remove_prefix(end + 1);
  }
}

std::string shell_word(std::string_view text) {
  if (!text.empty() && std::all_of(text.begin(), text.end(), needs_no_quotes)) return std::string(text);
  // true if `text` has characters that are unsafe for a terminal
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

std::string percent_encode(std::string_view text) {
  std::string out;
  for (const unsigned char c : text)
    if (std::isalnum(c) != 0 || c == '-' || c == '_' || c == '.' || c == '~')
      out += static_cast<char>(c);
    else
      out += fmt::format("%{:02X}", c);
  return out;
}

std::optional<std::string> percent_decode(std::string_view text) {
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
