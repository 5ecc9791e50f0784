#include "common/scene/gltf/uri.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "common/base/safe_text.h"

namespace ls::scene::gltf {
namespace {

constexpr std::string_view kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";

// Decodes base64 (RFC 4648), with or without the padding. nullopt: the text is not base64.
std::optional<std::string> decode_base64(std::string_view text) {
  while (text.ends_with('=')) text.remove_suffix(1);
  if (text.size() % 4 == 1) return std::nullopt;
  std::array<int, 256> value;
  value.fill(-1);
  for (std::size_t i = 0; i < kDigits.size(); ++i)
    value[static_cast<unsigned char>(kDigits[i])] = static_cast<int>(i);
  std::string out;
  out.reserve(text.size() / 4 * 3 + 2);
  unsigned bits = 0;
  int held = 0;
  for (const char c : text) {
    const int digit = value[static_cast<unsigned char>(c)];
    if (digit < 0) return std::nullopt;
    bits = (bits << 6 | static_cast<unsigned>(digit)) & 0xffff;
    held += 6;
    if (held < 8) continue;
    held -= 8;
    out += static_cast<char>(bits >> held & 0xff);
  }
  return out;
}

// True if the name can be written to XML and JSON and read back unchanged.
bool is_name(const std::string& name) {
  const bool is_text = std::min(find_invalid_utf8(name), find_control(name)) == std::string::npos;
  return is_text && !name.empty() && name.find_first_of("\t\r\n") == std::string::npos;
}

// True for "https://...", false for "C:/..." and "a:b".
bool has_scheme(std::string_view uri) {
  const auto colon = uri.find("://");
  return colon != std::string_view::npos && colon > 1;
}

}  // namespace

std::optional<Uri> read_uri(const Item& uri) {
  const std::string given = uri.text("");
  if (given.starts_with("data:")) {
    const auto comma = given.find(',');
    const bool is_base64 = comma != std::string::npos && given.substr(0, comma).ends_with(";base64");
    auto bytes = is_base64 ? decode_base64(std::string_view(given).substr(comma + 1)) : std::nullopt;
    if (bytes) return Uri{true, std::move(*bytes)};
    uri.error("this data URI is broken: only base64 is read, as in \"data:image/png;base64,...\"");
    return std::nullopt;
  }
  if (has_scheme(given)) {
    uri.error("nothing is fetched from elsewhere: put the file beside this one, and name it");
    return std::nullopt;
  }
  auto name = percent_decode(given);
  if (name && is_name(*name)) return Uri{false, std::move(*name)};
  uri.error("this names no file");
  return std::nullopt;
}

}  // namespace ls::scene::gltf
