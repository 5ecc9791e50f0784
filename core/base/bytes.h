// Reads numbers and words from untrusted bytes.
#pragma once

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <optional>
#include <span>
#include <string_view>

namespace ls {

static_assert(std::endian::native == std::endian::little);

inline std::string_view as_text(std::span<const std::byte> b) {
  return {reinterpret_cast<const char*>(b.data()), b.size()};
}

// A bounds-checked cursor. If too few bytes are left, its functions return nullopt and do not advance.
class ByteReader {
 public:
  explicit ByteReader(std::span<const std::byte> data) : data_(data) {}

  std::size_t position() const { return position_; }
  std::size_t left() const { return data_.size() - position_; }
  std::optional<std::span<const std::byte>> bytes(std::uint64_t n) {
    if (n > left()) return std::nullopt;
    position_ += n;
    return data_.subspan(position_ - n, n);
  }
  bool skip(std::uint64_t n) { return bytes(n).has_value(); }
  template <class T>
  std::optional<T> take(bool big_endian = false) {
    const auto from = bytes(sizeof(T));
    if (!from) return std::nullopt;
    std::byte raw[sizeof(T)];
    for (std::size_t i = 0; i < sizeof(T); ++i) raw[i] = (*from)[big_endian ? sizeof(T) - 1 - i : i];
    T v;
    std::memcpy(&v, raw, sizeof v);
    return v;
  }
  // Reads a zero-terminated text of at most `longest` characters. The text is returned without the zero.
  std::optional<std::string_view> name(std::size_t longest) {
    const std::string_view rest = as_text(data_.subspan(position_));
    const std::size_t length = rest.substr(0, longest + 1).find('\0');
    if (length == rest.npos) return std::nullopt;
    position_ += length + 1;
    return rest.substr(0, length);
  }

 private:
  std::span<const std::byte> data_;
  std::size_t position_ = 0;
};

// Removes the next word (a run of non-blank characters) from the front of `line` and returns it; returns an
// empty word at the end of the line.
inline std::string_view next_word(std::string_view& line) {
  const std::size_t a = line.find_first_not_of(" \t\r\v\f");
  if (a == line.npos) return line = {};
  const std::size_t b = std::min(line.find_first_of(" \t\r\v\f", a), line.size());
  const std::string_view word = line.substr(a, b - a);
  line.remove_prefix(b);
  return word;
}
// Removes the text up to and including the next `end` (a line feed, unless said otherwise) from the front of
// `text`, and returns it without `end`.
inline std::string_view next_line(std::string_view& text, char end = '\n') {
  const std::size_t n = std::min(text.find(end), text.size());
  const std::string_view line = text.substr(0, n);
  text.remove_prefix(std::min(n + 1, text.size()));
  return line;
}
// Returns the character at the end of each line of `text`: a carriage return if the first line ends in one
// that no line feed follows, as in files of old Macintosh programs, else a line feed.
inline char line_end_of(std::string_view text) {
  const std::size_t first = text.find_first_of("\r\n");
  const bool lone = first != text.npos && text[first] == '\r' && text.substr(first + 1, 1) != "\n";
  return lone ? '\r' : '\n';
}

}  // namespace ls
