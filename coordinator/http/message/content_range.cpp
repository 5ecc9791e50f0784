#include "coordinator/http/message/content_range.h"

#include <charconv>

namespace ls::http {
namespace {

// Numbers above this are rejected. It is larger than any file, yet sums of two such numbers stay below 2^64.
constexpr std::uint64_t kMost = std::uint64_t{1} << 62;

std::optional<std::uint64_t> number(std::string_view text) {
  std::uint64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (text.empty() || error != std::errc() || end != text.data() + text.size() || value > kMost)
    return std::nullopt;
  return value;
}

}  // namespace

std::optional<ContentRange> parse_content_range(std::string_view value) {
  constexpr std::string_view kUnit = "bytes ";
  if (!value.starts_with(kUnit)) return std::nullopt;
  value.remove_prefix(kUnit.size());
  const std::size_t slash = value.find('/');
  if (slash == std::string_view::npos) return std::nullopt;
  const auto size = number(value.substr(slash + 1));
  const std::string_view range = value.substr(0, slash);
  if (!size) return std::nullopt;
  if (range == "*") return ContentRange{*size, 0, *size, *size > 0};
  const std::size_t dash = range.find('-');
  if (dash == std::string_view::npos) return std::nullopt;
  const auto first = number(range.substr(0, dash)), last = number(range.substr(dash + 1));
  if (!first || !last) return std::nullopt;
  if (*last < *first || *last >= *size) return ContentRange{*first, 0, *size, false};
  return ContentRange{*first, *last - *first + 1, *size, true};
}

}  // namespace ls::http
