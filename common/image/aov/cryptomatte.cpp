#include "common/image/aov/cryptomatte.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <nlohmann/json.hpp>

namespace ls {
namespace {

std::uint32_t scrambled(std::uint32_t k) { return std::rotl(k * 0xcc9e2d51u, 15) * 0x1b873593u; }

}  // namespace

std::uint32_t murmur3_32(std::string_view text) {
  static_assert(std::endian::native == std::endian::little);
  std::uint32_t h = 0;
  std::size_t i = 0;
  for (; i + 4 <= text.size(); i += 4) {
    std::uint32_t k = 0;
    std::memcpy(&k, text.data() + i, 4);
    h = std::rotl(h ^ scrambled(k), 13) * 5 + 0xe6546b64u;
  }
  std::uint32_t rest = 0;
  std::memcpy(&rest, text.data() + i, text.size() - i);
  if (i < text.size()) h ^= scrambled(rest);
  h ^= static_cast<std::uint32_t>(text.size());
  h = (h ^ h >> 16) * 0x85ebca6bu;
  h = (h ^ h >> 13) * 0xc2b2ae35u;
  return h ^ h >> 16;
}

float cryptomatte_id(std::string_view name) {
  std::uint32_t hash = murmur3_32(name);
  const std::uint32_t exponent = hash >> 23 & 255;
  if (exponent == 0 || exponent == 255) hash ^= 1u << 23;
  return std::bit_cast<float>(hash);
}

std::string cryptomatte_manifest(std::vector<std::string> names) {
  nlohmann::json manifest = nlohmann::json::object();
  for (const std::string& name : names)
    manifest[name] = fmt::format("{:08x}", std::bit_cast<std::uint32_t>(cryptomatte_id(name)));
  return manifest.dump(-1, ' ', true, nlohmann::json::error_handler_t::replace);
}

std::map<std::string, std::string> cryptomatte_header(std::string_view layer, const std::string& manifest) {
  const std::string key =
      fmt::format("cryptomatte/{}/", fmt::format("{:08x}", murmur3_32(layer)).substr(0, 7));
  std::map<std::string, std::string> header{{key + "name", std::string(layer)},
                                            {key + "hash", "MurmurHash3_32"},
                                            {key + "conversion", "uint32_to_float32"}};
  if (!manifest.empty()) header[key + "manifest"] = manifest;
  return header;
}

}  // namespace ls
