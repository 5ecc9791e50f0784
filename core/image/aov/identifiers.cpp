#include "core/image/aov/identifiers.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>

namespace ls {

namespace {

bool before(const IdSlot& a, const IdSlot& b) {
  return a.n != b.n ? a.n > b.n : std::bit_cast<std::uint32_t>(a.id) < std::bit_cast<std::uint32_t>(b.id);
}

IdSlots largest(std::vector<IdSlot>& all, float more) {
  std::sort(all.begin(), all.end(), before);
  IdSlots out;
  out.more = more;
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (i < out.slots.size())
      out.slots[i] = all[i];
    else
      out.more += all[i].n;
  }
  return out;
}

bool is_count(float n) { return n >= 0 && n <= 0x1p24f && n == std::floor(n) && !std::signbit(n); }

}  // namespace

bool is_identifier(float id) { return std::isnormal(id); }

IdSlots ranked(std::vector<IdSlot> seen) { return largest(seen, 0); }

IdSlots operator+(const IdSlots& a, const IdSlots& b) {
  std::vector<IdSlot> all;
  all.reserve(2 * kIdSlots);
  for (const IdSlot& s : a.slots)
    if (s.n > 0) all.push_back(s);
  for (const IdSlot& s : b.slots) {
    if (!(s.n > 0)) continue;
    const auto same = std::find_if(all.begin(), all.end(), [&](const IdSlot& x) { return x.id == s.id; });
    if (same != all.end())
      same->n += s.n;
    else
      all.push_back(s);
  }
  return largest(all, a.more + b.more);
}

std::string wrong_with(const IdSlots& slots, std::uint64_t samples) {
  if (!is_count(slots.more)) return fmt::format("{} samples beyond the slots are no count", slots.more);
  double sum = slots.more;
  for (std::size_t i = 0; i < slots.slots.size(); ++i) {
    const IdSlot& s = slots.slots[i];
    if (!is_count(s.n)) return fmt::format("slot {} has {} samples", i, s.n);
    if (s.n == 0 ? std::bit_cast<std::uint32_t>(s.id) != 0 : !is_identifier(s.id))
      return fmt::format("slot {} has the identifier {}", i, s.id);
    if (i && s.n > 0 && !before(slots.slots[i - 1], s)) return fmt::format("slot {} is out of order", i);
    if (i && s.n == 0 && slots.more > 0) return fmt::format("slot {} is free, but samples lie beyond", i);
    for (std::size_t k = 0; k < i; ++k)
      if (s.n > 0 && slots.slots[k].id == s.id) return fmt::format("slot {} repeats an identifier", i);
    sum += s.n;
  }
  if (sum > static_cast<double>(samples))
    return fmt::format("its slots have {} samples, the unit has {}", sum, samples);
  return {};
}

IdSlots load_slots(const float* planes, std::size_t stride) {
  IdSlots out;
  for (std::size_t i = 0; i < kIdSlots; ++i)
    out.slots[i] = {planes[2 * i * stride], planes[(2 * i + 1) * stride]};
  out.more = planes[2 * kIdSlots * stride];
  return out;
}

void store_slots(const IdSlots& slots, float* planes, std::size_t stride) {
  for (std::size_t i = 0; i < kIdSlots; ++i) {
    planes[2 * i * stride] = slots.slots[i].id;
    planes[(2 * i + 1) * stride] = slots.slots[i].n;
  }
  planes[2 * kIdSlots * stride] = slots.more;
}

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
