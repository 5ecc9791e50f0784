#include "proto/convert_check.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace ls::wire {
namespace {

// Returns the number of bytes of the UTF-8 character at `i` (RFC 3629: shortest forms, no surrogates, up to
// U+10FFFF); 0 if there is no such character at `i`.
std::size_t character_length(const std::string& text, std::size_t i) {
  const auto byte = [&](std::size_t k) { return k < text.size() ? static_cast<unsigned char>(text[k]) : 0U; };
  const unsigned first = byte(i);
  if (first < 0x80) return 1;
  const std::size_t length = first >= 0xC2 && first < 0xE0   ? 2
                             : first >= 0xE0 && first < 0xF0 ? 3
                             : first >= 0xF0 && first < 0xF5 ? 4
                                                             : 0;
  for (std::size_t k = 1; k < length; ++k)
    if ((byte(i + k) & 0xC0) != 0x80) return 0;
  const unsigned second = byte(i + 1);
  const bool wrong = (first == 0xE0 && second < 0xA0) || (first == 0xED && second > 0x9F) ||
                     (first == 0xF0 && second < 0x90) || (first == 0xF4 && second > 0x8F);
  return wrong ? 0 : length;
}

}  // namespace

tl::unexpected<Error> wrong(const std::string& field, const std::string& what) {
  return fail(Errc::invalid_argument, fmt::format("bad message: {} {}", field, what));
}

Result<std::string> id_from(const std::string& text, const char* field) {
  if (text.empty()) return wrong(field, "is missing");
  if (text.size() > limits::kIdBytes)
    return wrong(field, fmt::format("has {} bytes; at most {} are allowed", text.size(), limits::kIdBytes));
  for (const char c : text)
    if (c <= ' ' || c > '~') return wrong(field, "has a character that is not printable ASCII");
  return text;
}

Result<std::string> text_from(const std::string& text, std::size_t limit, const char* field) {
  if (text.size() > limit)
    return wrong(field, fmt::format("has {} bytes; at most {} are allowed", text.size(), limit));
  std::string clean = text;
  for (char& c : clean)
    if (static_cast<unsigned char>(c) < 0x20 && c != '\n') c = ' ';
  return clean;
}

Result<double> seconds_from(double value, const char* field) {
  if (!(value >= 0 && value <= limits::kSeconds))
    return wrong(field,
                 fmt::format("is {}; it must be a time in seconds, at most {}", value, limits::kSeconds));
  return value;
}

Result<PixelRect> rect_from(const pb::Rect& rect, const char* field) {
  const PixelRect r{rect.x0(), rect.y0(), rect.x1(), rect.y1()};
  const bool inside = r.x0 >= 0 && r.y0 >= 0 && r.x1 <= limits::kFrameSide && r.y1 <= limits::kFrameSide;
  if (!inside || r.x0 >= r.x1 || r.y0 >= r.y1)
    return wrong(field,
                 fmt::format("[{}, {}) x [{}, {}) is empty or outside any frame", r.x0, r.x1, r.y0, r.y1));
  return r;
}

Result<SampleRange> range_from(std::uint64_t s0, std::uint64_t s1, const char* field) {
  if (s0 % 2 != 0 || s1 % 2 != 0 || s0 >= s1 || s1 > limits::kSampleIndex)
    return wrong(field, fmt::format("[{}, {}) must be a non-empty range with even ends up to {}", s0, s1,
                                    limits::kSampleIndex));
  return SampleRange{s0, s1};
}

std::string sendable(const std::string& text, std::size_t limit) {
  std::string out;
  for (std::size_t i = 0; i < text.size();) {
    const std::size_t length = character_length(text, i);
    if (out.size() + std::max<std::size_t>(length, 1) > limit) break;
    if (length == 0) {
      out += '?';
      ++i;
    } else {
      out.append(text, i, length);
      i += length;
    }
  }
  return out;
}

}  // namespace ls::wire
