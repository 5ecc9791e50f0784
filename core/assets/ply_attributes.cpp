#include "core/assets/mesh_parts.h"

#include <algorithm>
#include <array>
#include <optional>
#include <set>

namespace ls {
namespace {

constexpr std::array<std::string_view, 4> kKinds = {"xyzw", "rgba", "0123", "1234"};
constexpr std::string_view kReserved[] = {
    "x",         "y",         "z",         "nx", "ny", "nz", "u", "v",   "s",     "t",    "texture_u",
    "texture_v", "texture_s", "texture_t", "r",  "g",  "b",  "a", "red", "green", "blue", "alpha"};

std::optional<PlyAttribute> colour(std::span<const std::string_view> names) {
  for (const auto& rgb : {std::array<std::string_view, 3>{"r", "g", "b"}, {"red", "green", "blue"}}) {
    PlyAttribute a{"color", {}};
    for (const std::string_view channel : rgb)
      if (const auto it = std::ranges::find(names, channel); it != names.end())
        a.properties.push_back(static_cast<std::size_t>(it - names.begin()));
    if (a.properties.size() == 3) return a;
  }
  return std::nullopt;
}

// Consecutive properties of one attribute: a prefix, and then one character of `kind`, in the order of
// `kind`. The properties foo_x and foo_y have the prefix foo_ and begin the kind "xyzw". kKinds lists all
// kinds.
struct Run {
  std::string_view prefix;
  std::string_view kind;
  std::vector<std::size_t> properties;
};

}  // namespace

std::vector<PlyAttribute> ply_attributes(std::span<const std::string_view> names) {
  std::vector<PlyAttribute> found;
  if (auto rgb = colour(names)) found.push_back(std::move(*rgb));
  std::set<std::string_view> done;
  Run run;
  const auto flush = [&] {
    const std::size_t n = run.properties.size();
    if (n == 1 || n == 3) {
      done.insert(run.prefix);
      found.push_back({std::string(run.prefix) + (run.kind == "rgba" ? "_color" : ""), run.properties});
    }
    run = {};
  };
  for (std::size_t i = 0; i < names.size(); ++i) {
    const std::string_view name = names[i];
    if (name.empty() || std::ranges::find(kReserved, name) != std::end(kReserved)) continue;
    const std::size_t at = name.find_last_of('_');
    const bool ours = at != name.npos && at > 0 && at + 2 == name.size();
    const std::string_view prefix = ours ? name.substr(0, at) : std::string_view{};
    if (!ours || prefix != run.prefix) flush();
    if (!ours || done.contains(prefix)) continue;
    if (run.properties.empty()) {
      const auto kind = std::ranges::find_if(kKinds, [&](auto k) { return k[0] == name.back(); });
      if (kind == kKinds.end()) continue;
      run = {prefix, *kind, {i}};
    } else if (run.properties.size() < 4 && run.kind[run.properties.size()] == name.back()) {
      run.properties.push_back(i);
    } else {  // the property does not continue the run, so its prefix becomes no attribute
      done.insert(prefix);
      run = {};
    }
  }
  flush();
  return found;
}

}  // namespace ls
