#include "tests/fuzz/fuzz.h"

#include <algorithm>
#include <cstdio>

namespace ls::fuzz {

void must(bool kept, std::string_view promise) {
  if (kept) return;
  std::fprintf(stderr, "broken promise: %.*s\n", static_cast<int>(promise.size()), promise.data());
  __builtin_trap();
}

std::vector<Bytes> parts_of(Bytes input, std::size_t most) {
  std::vector<Bytes> parts;
  while (!input.empty() && parts.size() + 1 < most && input.size() >= 2) {
    const std::size_t length = std::min<std::size_t>(input[0] | input[1] << 8, input.size() - 2);
    parts.push_back(input.subspan(2, length));
    input = input.subspan(2 + length);
  }
  if (!input.empty()) parts.push_back(input);
  return parts;
}

std::string with_length(std::string_view part) {
  std::string out{static_cast<char>(part.size() & 255), static_cast<char>(part.size() >> 8)};
  return out.append(part);
}

}  // namespace ls::fuzz
