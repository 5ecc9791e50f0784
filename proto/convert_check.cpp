#include "proto/convert_check.h"

#include <fmt/format.h>

#include <cmath>


namespace ls::wire {

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
  if (!std::isfinite(value) || value < 0) return wrong(field, fmt::format("is {}; it must be a time in seconds", value));
  return value;
}

Result<PixelRect> rect_from(const pb::Rect& rect, const char* field) {
  const PixelRect r{rect.x0(), rect.y0(), rect.x1(), rect.y1()};
  const bool inside = r.x0 >= 0 && r.y0 >= 0 && r.x1 <= limits::kFrameSide && r.y1 <= limits::kFrameSide;
  if (!inside || r.x0 >= r.x1 || r.y0 >= r.y1)
    return wrong(field, fmt::format("[{}, {}) x [{}, {}) is empty or outside any frame", r.x0, r.x1, r.y0, r.y1));
  return r;
}

Result<SampleRange> range_from(std::uint64_t s0, std::uint64_t s1, const char* field) {
  if (s0 % 2 != 0 || s1 % 2 != 0 || s0 >= s1 || s1 > limits::kSampleIndex)
    return wrong(field, fmt::format("[{}, {}) must be a non-empty range with even ends up to {}", s0, s1,
                                    limits::kSampleIndex));
  return SampleRange{s0, s1};
}

std::string cut(const std::string& text, std::size_t limit) {
  if (text.size() <= limit) return text;
  std::size_t end = limit;
  while (end > 0 && (static_cast<unsigned char>(text[end]) & 0xC0) == 0x80) --end;
  return text.substr(0, end);
}

}  // namespace ls::wire
