#include "core/image/exr/seal.h"

#include <ImfVersion.h>

#include <algorithm>
#include <array>
#include <bit>
#include <set>
#include <sstream>
#include <string_view>
#include <utility>

#include "core/base/overloaded.h"
#include "core/image/exr/final_image.h"
#include "core/image/exr/memory.h"

namespace ls::exr {
namespace {

// Attributes that the seal does not cover: those that describe how the pixels are stored, and the seal
// itself.
constexpr std::array<std::string_view, 5> kLeftOut = {"compression", "lineOrder", "chunkCount", "type",
                                                      kSealName};

// Parses a seal. Returns the digest of each line by the name of what it covers, such as "layer R". A line
// that is too short to have a digest and a name is stored with the whole line as its name.
std::map<std::string, std::string> lines_of(const std::string& seal) {
  constexpr std::size_t kDigits = 64;
  std::map<std::string, std::string> lines;
  std::istringstream in(seal);
  for (std::string line; std::getline(in, line);)
    lines[line.size() > kDigits + 1 ? line.substr(kDigits + 1) : line] = line.substr(0, kDigits);
  return lines;
}

}  // namespace

void Seal::add(const ExrPicture& rows) {
  static_assert(std::endian::native == std::endian::little);
  for (const auto& [name, channel] : rows.channels) {
    Sha256& hash = layers_[name];
    std::visit(overloaded{[&](const ExrHalf& c) {
                            std::vector<float> stored(c.values.size());
                            std::transform(c.values.begin(), c.values.end(), stored.begin(), as_half);
                            hash.update(std::as_bytes(std::span(stored)));
                          },
                          [&](const auto& c) { hash.update(std::as_bytes(std::span(c.values))); }},
               channel);
  }
}

void Seal::add(const Imf::Header& header) {
  const std::string prefix = std::exchange(first_part_, false) ? "" : header.name() + ":";
  for (auto at = header.begin(); at != header.end(); ++at) {
    if (std::find(kLeftOut.begin(), kLeftOut.end(), at.name()) != kLeftOut.end()) continue;
    MemoryWriter value;
    at.attribute().writeValueTo(value, Imf::EXR_VERSION);
    Sha256 hash;
    hash.update(std::string_view(at.attribute().typeName()));
    hash.update(std::string_view("\0", 1));
    hash.update(value.take());
    attributes_[prefix + at.name()] = hash.finish();
  }
}

std::string Seal::text() {
  std::string out;
  for (const auto& [name, digest] : attributes_) out += fmt::format("{} header {}\n", digest.hex(), name);
  for (auto& [name, hash] : layers_) out += fmt::format("{} layer {}\n", hash.finish().hex(), name);
  return out;
}

ExrPicture values_of(const DeepRows& rows, bool colours, bool halves) {
  ExrPicture picture{rows.size, {}, {}};
  const auto add = [&](const char* name, bool as_halves, const auto& value) {
    std::vector<float> values;
    values.reserve(rows.samples.size());
    for (const DeepSample& s : rows.samples) values.push_back(value(s));
    if (as_halves)
      picture.channels[name] = ExrHalf{std::move(values)};
    else
      picture.channels[name] = ExrFloat{std::move(values)};
  };
  constexpr const char* kRgb[] = {"R", "G", "B"};
  for (std::size_t c = 0; c < 3 && colours; ++c)
    add(kRgb[c], halves, [c](const DeepSample& s) { return s.rgb[c]; });
  add("A", halves, [](const DeepSample& s) { return s.alpha; });
  add("Z", false, [](const DeepSample& s) { return s.z; });
  add("ZBack", false, [](const DeepSample& s) { return s.z_back; });
  picture.channels["samples"] = ExrUint{rows.counts};
  return picture;
}

std::vector<std::string> differences(const std::string& sealed, const std::string& now) {
  const auto before = lines_of(sealed), after = lines_of(now);
  std::set<std::string> names;
  for (const auto& [ours, theirs] : {std::pair(&before, &after), std::pair(&after, &before)})
    for (const auto& [name, digest] : *ours) {
      const auto found = theirs->find(name);
      if (found == theirs->end() || found->second != digest) names.insert(name);
    }
  std::vector<std::string> out(names.begin(), names.end());
  // If all names and digests are equal but the texts differ (for example in the order of lines), somebody has
  // edited the seal. Then the seal itself is reported as the header that differs.
  if (out.empty() && sealed != now) out.emplace_back(fmt::format("header {}", kSealName));
  return out;
}

}  // namespace ls::exr
