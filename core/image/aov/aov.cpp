#include "core/image/aov/aov.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <iterator>

#include "core/image/aov/identifiers.h"

namespace ls {
namespace {

constexpr std::array<AovRow, kAovs> kAovRows = {{
    {Aov::albedo, "albedo", AovKind::of_all, "RGB", true},
    {Aov::alpha, "alpha", AovKind::opacity, "A", true},
    {Aov::coverage, "coverage", AovKind::of_all, "A", true},
    {Aov::denoising_albedo, "denoising_albedo", AovKind::guide, "RGB", true},
    {Aov::denoising_normal, "denoising_normal", AovKind::guide, "XYZ", true},
    {Aov::depth, "depth", AovKind::of_hits, "Z", false},
    {Aov::direct, "direct", AovKind::light, "RGB", true},
    {Aov::emission, "emission", AovKind::light, "RGB", true},
    {Aov::geo_normal, "geo_normal", AovKind::of_all, "XYZ", true},
    {Aov::indirect, "indirect", AovKind::light, "RGB", true},
    {Aov::light_groups, "light_groups", AovKind::groups, "RGB", true},
    {Aov::material_id, "material_id", AovKind::ids, "", false},
    {Aov::multiple, "multiple", AovKind::light, "RGB", true},
    {Aov::normal, "normal", AovKind::of_all, "XYZ", true},
    {Aov::opacity, "opacity", AovKind::opacity, "RGB", true},
    {Aov::position, "position", AovKind::of_hits, "XYZ", false},
    {Aov::shadow_catcher, "shadow_catcher", AovKind::opacity, "LTU", false},
    {Aov::shape_id, "shape_id", AovKind::ids, "", false},
    {Aov::single, "single", AovKind::light, "RGB", true},
    {Aov::surface, "surface", AovKind::light, "RGB", true},
    {Aov::uv, "uv", AovKind::of_hits, "UV", false},
    {Aov::volume, "volume", AovKind::light, "RGB", true},
    {Aov::volume_light_groups, "volume_light_groups", AovKind::groups, "RGB", true},
    {Aov::volume_opacity, "volume_opacity", AovKind::opacity, "RGB", true},
}};
static_assert([] {
  for (std::size_t i = 0; i < kAovs; ++i)
    if (static_cast<std::size_t>(kAovRows[i].aov) != i || (i && kAovRows[i - 1].name >= kAovRows[i].name))
      return false;
  return true;
}());

struct Alias {
  std::string_view name;
  Aov aov;
};
constexpr Alias kAliases[] = {
    {"crypto_material", Aov::material_id},
    {"crypto_object", Aov::shape_id},
    {"geometric_normal", Aov::geo_normal},
    {"material", Aov::material_id},
    {"multiple_scattering", Aov::multiple},
    {"object_id", Aov::shape_id},
    {"sh_normal", Aov::normal},
    {"shading_normal", Aov::normal},
    {"shape", Aov::shape_id},
    {"single_scattering", Aov::single},
};
// Names of the two layers that every image has, and other names for them.
constexpr std::string_view kAlways[] = {"spp", "stderr", "sample_count", "standard_error"};

constexpr std::size_t kMostShown = 64;  // a message shows at most this many characters of a wrong name

std::string plain(std::string_view name) {
  std::string out;
  for (const char c : name.substr(0, kMostShown))
    out += c == '-' ? '_' : static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return out;
}

// Returns the beginning of a wrong name for a message; characters that are not printable ASCII become '?'.
std::string shown(std::string_view name) {
  std::string out(name.substr(0, kMostShown));
  for (char& c : out)
    if (c < 0x20 || c > 0x7e) c = '?';
  return out;
}

}  // namespace

std::span<const AovRow> aov_rows() { return kAovRows; }
bool is_colour(Aov aov) {
  const AovKind kind = row_of(aov).kind;
  return kind == AovKind::light || kind == AovKind::groups || aov == Aov::albedo ||
         aov == Aov::denoising_albedo;
}

const AovRow& row_of(Aov aov) { return kAovRows[static_cast<std::size_t>(aov)]; }

AovSet aovs_of(AovKind kind) {
  AovSet set;
  for (const AovRow& row : kAovRows)
    if (row.kind == kind) set = set.with(row.aov);
  return set;
}

Result<AovSet> parse_aovs(std::span<const std::string> names) {
  AovSet set;
  for (const std::string& name : names) {
    const std::string asked = plain(name);
    if (std::find(std::begin(kAlways), std::end(kAlways), asked) != std::end(kAlways)) continue;
    const auto row =
        std::find_if(kAovRows.begin(), kAovRows.end(), [&](const AovRow& r) { return r.name == asked; });
    const auto alias = std::find_if(std::begin(kAliases), std::end(kAliases),
                                    [&](const Alias& a) { return a.name == asked; });
    if (row != kAovRows.end())
      set = set.with(row->aov);
    else if (alias != std::end(kAliases))
      set = set.with(alias->aov);
    else
      return bad_argument(
          fmt::format("there is no output \"{}\"; there are {}, and in every image spp and stderr",
                      shown(name), known_aovs()));
  }
  return set;
}

std::vector<std::string> names_of(AovSet set) {
  std::vector<std::string> names;
  for (const AovRow& row : kAovRows)
    if (set.has(row.aov)) names.emplace_back(row.name);
  return names;
}

std::string known_aovs() {
  std::vector<std::string_view> names;
  for (const AovRow& row : kAovRows) names.push_back(row.name);
  return fmt::format("{}", fmt::join(names, ", "));
}

AovPlanes planes_of(AovSet set) {
  AovPlanes out;
  for (const AovRow& row : kAovRows) {
    if (!set.has(row.aov)) continue;
    if (row.kind == AovKind::ids) {
      out.ids.push_back(row.aov);
      continue;
    }
    const bool by_group = row.kind == AovKind::groups;
    for (std::size_t g = 0; g < (by_group ? set.groups() : 1); ++g) {
      const std::string layer = by_group ? fmt::format("{}.{:02}", row.name, g) : std::string(row.name);
      for (std::size_t c = 0; c < row.components.size(); ++c) {
        const char letter = row.components[c];
        AovPlane plane{.name = {}, .aov = row.aov, .component = static_cast<int>(c), .group = g};
        for (plane.half = 0; plane.half < (has_halves(row.kind) ? 2 : 1); ++plane.half) {
          plane.name = has_halves(row.kind) ? fmt::format("aov.{}.{}.{}", layer, "AB"[plane.half], letter)
                                            : fmt::format("aov.{}.{}", layer, letter);
          out.sums.push_back(plane);
        }
      }
    }
  }
  if (set.any_of(aovs_of(AovKind::of_hits))) out.sums.push_back({.name = "aov.hits", .hits = true});
  std::sort(out.sums.begin(), out.sums.end(),
            [](const AovPlane& a, const AovPlane& b) { return a.name < b.name; });
  for (std::size_t i = 0; i < out.sums.size(); ++i) {
    if (out.sums[i].hits) out.hits = i;
    out.names.push_back(out.sums[i].name);
  }
  if (set.deep().count > 0) {
    std::ranges::move(names_of_deep_planes(set.deep()), std::back_inserter(out.names));
    out.deep = out.names.size() - out.sums.size();
  }
  for (const Aov aov : out.ids) {
    for (int slot = 0; slot < kIdSlots; ++slot) {
      out.names.push_back(fmt::format("id.{}.{}.id", row_of(aov).name, slot));
      out.names.push_back(fmt::format("id.{}.{}.n", row_of(aov).name, slot));
    }
    out.names.push_back(fmt::format("id.{}.more", row_of(aov).name));
  }
  return out;
}

std::size_t partial_bytes_per_pixel(AovSet set) {
  return sizeof(float) * (kPartialChannels + planes_of(set).count());
}

std::size_t film_bytes_per_pixel(AovSet set) {
  const AovPlanes planes = planes_of(set);
  return sizeof(double) * (kPartialChannels + planes.all_sums()) +
         sizeof(float) * kIdPlanes * planes.ids.size();
}

}  // namespace ls
