#include <fmt/format.h>

#include <bit>
#include <limits>
#include <nlohmann/json.hpp>

#include "core/image/film/partial.h"

namespace ls {
namespace {

// Largest size of a header's JSON text, in bytes. The texts of canonical_json() have about 320.
constexpr std::size_t kMaxHeaderJson = 1024;

tl::unexpected<Error> bad(std::string_view what) {
  return bad_argument(fmt::format("unit header: {}", what));
}

Result<Digest> digest_at(const nlohmann::json& json, const char* key) {
  const auto it = json.find(key);
  if (it == json.end() || !it->is_string()) return bad(fmt::format("'{}' must be a string", key));
  const auto digest = Digest::parse(it->get_ref<const std::string&>());
  if (!digest) return bad(fmt::format("'{}' must be 64 lower-case hexadecimal digits", key));
  return *digest;
}

Result<std::uint64_t> sample_at(const nlohmann::json& json, const char* key) {
  const auto it = json.find(key);
  if (it == json.end() || !it->is_number_unsigned())
    return bad(fmt::format("'{}' must be a whole number, not negative", key));
  const auto value = it->get<std::uint64_t>();
  if (value % 2 != 0)
    return bad(fmt::format("'{}' is {}, but sample ranges end at even numbers", key, value));
  return value;
}

Result<PixelRect> rect_at(const nlohmann::json& json, const char* key) {
  const auto it = json.find(key);
  const auto error = [&] {
    return bad(fmt::format("'{}' must be [x0,y0,x1,y1] with 0 <= x0 < x1, 0 <= y0 < y1", key));
  };
  if (it == json.end() || !it->is_array() || it->size() != 4) return error();
  int v[4];
  for (std::size_t i = 0; i < 4; ++i) {
    const auto& entry = (*it)[i];
    if (!entry.is_number_unsigned() || entry.get<std::uint64_t>() > std::numeric_limits<int>::max())
      return error();
    v[i] = entry.get<int>();
  }
  if (v[0] >= v[2] || v[1] >= v[3]) return error();
  return PixelRect{v[0], v[1], v[2], v[3]};
}

}  // namespace

std::string canonical_json(const UnitHeader& h) {
  return fmt::format(R"({{"class":"{}","s0":{},"s1":{},"scene":"{}","settings":"{}","tile":[{},{},{},{}]}})",
                     h.numeric_class.hex(), h.samples.s0, h.samples.s1, h.scene.hex(), h.settings.hex(),
                     h.tile.x0, h.tile.y0, h.tile.x1, h.tile.y1);
}

Result<UnitHeader> parse_unit_header(std::string_view text) {
  if (text.size() > kMaxHeaderJson) return bad(fmt::format("longer than {} bytes", kMaxHeaderJson));
  const auto json = nlohmann::json::parse(text, nullptr, /*allow_exceptions=*/false);
  if (json.is_discarded() || !json.is_object()) return bad("not a JSON object");
  const auto scene = digest_at(json, "scene"), settings = digest_at(json, "settings"),
             numeric = digest_at(json, "class");
  for (const auto* d : {&scene, &settings, &numeric})
    if (!*d) return tl::unexpected(d->error());
  const auto s0 = sample_at(json, "s0"), s1 = sample_at(json, "s1");
  for (const auto* s : {&s0, &s1})
    if (!*s) return tl::unexpected(s->error());
  if (*s0 >= *s1) return bad(fmt::format("sample range [{}, {}) is empty", *s0, *s1));
  const auto tile = rect_at(json, "tile");
  if (!tile) return tl::unexpected(tile.error());

  const UnitHeader header{*scene, *settings, *numeric, *tile, {*s0, *s1}};
  // unit_digest() covers the text of the header. So a header must have only one valid text.
  if (canonical_json(header) != text)
    return bad(
        "not in canonical form (sorted keys class, s0, s1, scene, settings, tile; no spaces; nothing else)");
  return header;
}

Digest unit_digest(const Partial& partial) {
  static_assert(std::endian::native == std::endian::little, "the digest is over little-endian floats");
  Sha256 hash;
  hash.update(canonical_json(partial.header));
  hash.update(std::as_bytes(std::span(partial.sums)));
  return hash.finish();
}

}  // namespace ls
