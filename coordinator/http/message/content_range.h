// Parses the Content-Range header of one request of an upload in parts: "bytes FIRST-LAST/SIZE" (RFC 9110,
// 14.4), or "bytes */SIZE" with an empty body if the client has sent everything before.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

namespace ls::http {

struct ContentRange {
  std::uint64_t first = 0;
  std::uint64_t bytes = 0;  // length of this part, LAST - FIRST + 1; 0: the header was "bytes */SIZE"
  std::uint64_t size = 0;   // SIZE: bytes of the whole upload
  bool possible = true;     // false: FIRST-LAST does not lie within SIZE bytes
  bool is_last() const { return first + bytes == size; }
};
// nullopt: the value has neither of the two forms.
std::optional<ContentRange> parse_content_range(std::string_view value);

}  // namespace ls::http
