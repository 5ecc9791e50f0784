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

std::string packed(const std::vector<std::string>& inputs) {
  std::string pack;
  for (const std::string& input : inputs) {
    for (int shift = 0; shift < 32; shift += 8) pack += static_cast<char>(input.size() >> shift & 255);
    pack += input;
  }
  return pack;
}

std::vector<std::string> unpacked(std::string_view pack) {
  std::vector<std::string> inputs;
  while (pack.size() >= 4) {
    std::size_t length = 0;
    for (std::size_t i = 0; i < 4; ++i) length |= std::size_t{static_cast<unsigned char>(pack[i])} << 8 * i;
    if (pack.size() - 4 < length) break;
    inputs.emplace_back(pack.substr(4, length));
    pack.remove_prefix(4 + length);
  }
  return inputs;
}

}  // namespace ls::fuzz
