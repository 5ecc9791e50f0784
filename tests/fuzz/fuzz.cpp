#include "tests/fuzz/fuzz.h"

#include <zlib.h>

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

namespace {

void put_size(std::string& to, std::size_t size) {
  for (int shift = 0; shift < 32; shift += 8) to += static_cast<char>(size >> shift & 255);
}
std::size_t size_at(std::string_view from) {
  std::size_t size = 0;
  for (std::size_t i = 0; i < 4; ++i) size |= std::size_t{static_cast<unsigned char>(from[i])} << 8 * i;
  return size;
}

}  // namespace

std::string packed(const std::vector<std::string>& inputs) {
  std::string all, pack;
  for (const std::string& input : inputs) {
    put_size(all, input.size());
    all += input;
  }
  put_size(pack, all.size());
  uLongf size = compressBound(all.size());
  pack.resize(4 + size);
  compress2(reinterpret_cast<Bytef*>(pack.data() + 4), &size, reinterpret_cast<const Bytef*>(all.data()),
            all.size(), Z_BEST_COMPRESSION);
  pack.resize(4 + size);
  return pack;
}

std::vector<std::string> unpacked(std::string_view pack) {
  constexpr std::size_t kMost = std::size_t{1} << 28;
  std::vector<std::string> inputs;
  if (pack.size() < 4 || size_at(pack) > kMost) return inputs;
  std::string all(size_at(pack), '\0');
  uLongf size = all.size();
  if (uncompress(reinterpret_cast<Bytef*>(all.data()), &size, reinterpret_cast<const Bytef*>(pack.data() + 4),
                 pack.size() - 4) != Z_OK)
    return inputs;
  for (std::string_view left(all.data(), size); left.size() >= 4 && left.size() - 4 >= size_at(left);) {
    inputs.emplace_back(left.substr(4, size_at(left)));
    left.remove_prefix(4 + inputs.back().size());
  }
  return inputs;
}

}  // namespace ls::fuzz
