#include "core/scene/schema/volume_rules.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <utility>
#include <vector>

#include "core/base/overloaded.h"
#include "core/scene/limits.h"

namespace ls::scene {
namespace {

// A volume within another one.
struct Part {
  std::string_view parameter;
  VolumeIndex volume;
};
std::vector<Part> parts_of(const Volume& v) {
  if (const auto* product = std::get_if<ProductVolume>(&v))
    return {{"first", product->first}, {"second", product->second}};
  if (const auto* remap = std::get_if<RemapVolume>(&v)) return {{"volume", remap->volume}};
  return {};
}

ParameterProblem box_problem(const Vec3& min, const Vec3& max) {
  for (std::size_t k = 0; k < 3; ++k)
    if (!(min[k] < max[k]))
      return {"max", fmt::format("is not above 'min' along {}: {} and {}", "xyz"[k], max[k], min[k])};
  return {};
}

ParameterProblem curve_problem(const RemapVolume& r) {
  const std::vector<double>&at = r.positions, &values = r.values;
  if (at.size() != values.size())
    return {"values", fmt::format("has {} numbers, and 'positions' {}", values.size(), at.size())};
  if (at.empty()) return {};
  if (at.size() < 2 || at.size() > kMaxRampPoints)
    return {"positions", fmt::format("has {} numbers; 2 to {} are wanted", at.size(), kMaxRampPoints)};
  for (std::size_t i = 1; i < at.size(); ++i)
    if (!(at[i] > at[i - 1]))
      return {"positions", fmt::format("must ascend: number {} is {} after {}", i + 1, at[i], at[i - 1])};
  return {};
}

bool is_constant(std::span<const Volume> volumes, VolumeIndex i) {
  return std::holds_alternative<ConstVolume>(volumes[i.value]);
}

// A volume other than a density. Values without a box have nowhere to be looked up.
ParameterProblem boundless(std::span<const Volume> volumes, std::string_view parameter, VolumeIndex i) {
  if (is_constant(volumes, i) || has_box(volumes, i)) return {};
  return {
      parameter,
      "has no box, as a \"heightfog\" has none: multiply it by a volume that has one, such as a \"noise\""};
}

}  // namespace

ParameterProblem volume_problem(std::span<const Volume> volumes, const Volume& volume) {
  for (const Part& part : parts_of(volume))
    if (const auto* c = std::get_if<ConstVolume>(&volumes[part.volume.value]); c && !is_grey(c->value))
      return {part.parameter,
              "is one number, not a colour; the 'tint' of the medium gives its density a colour"};
  return std::visit(
      overloaded{[](const HeightFogVolume& v) -> ParameterProblem {
                   if (v.ground_normal == Vec3{0, 0, 0}) return {"ground_normal", "has no direction"};
                   return {};
                 },
                 [](const NoiseVolume& v) { return box_problem(v.min, v.max); },
                 [](const CloudVolume& v) { return box_problem(v.min, v.max); },
                 [](const RemapVolume& v) -> ParameterProblem {
                   if (!(v.in_low < v.in_high))
                     return {"in_high", fmt::format("is not above 'in_low': {} and {}", v.in_high, v.in_low)};
                   return curve_problem(v);
                 },
                 [](const auto&) { return ParameterProblem{}; }},
      volume);
}

bool has_box(std::span<const Volume> volumes, VolumeIndex i) {
  const Volume& v = volumes[i.value];
  const std::vector<Part> parts = parts_of(v);
  if (!parts.empty())
    return std::ranges::any_of(parts, [&](const Part& p) { return has_box(volumes, p.volume); });
  return !std::holds_alternative<HeightFogVolume>(v) && !std::holds_alternative<ConstVolume>(v);
}

ParameterProblem medium_problem(std::span<const Volume> volumes, const HeterogeneousMedium& m) {
  const std::pair<std::string_view, std::optional<VolumeIndex>> others[] = {
      {"albedo", m.albedo},
      {"emission", m.emission},
      {"source_radiance", m.source_radiance},
      {"temperature", m.temperature},
      {"emission_weight", m.emission_weight}};
  if (std::holds_alternative<HeightFogVolume>(volumes[m.sigma_t.value])) {
    if (m.emission)
      return {"emission",
              "has no end in a \"heightfog\": give light in proportion to its density, by 'source_radiance'"};
    for (const auto& [parameter, volume] : others)
      if (volume && !is_constant(volumes, *volume))
        return {parameter,
                "is the same everywhere in a \"heightfog\": a constvolume or a number; where it has to vary, "
                "make the density a \"product\" of the heightfog and a volume that has a box"};
    return {};
  }
  if (auto problem = boundless(volumes, "sigma_t", m.sigma_t); !problem.what.empty()) return problem;
  for (const auto& [parameter, volume] : others)
    if (volume)
      if (auto problem = boundless(volumes, parameter, *volume); !problem.what.empty()) return problem;
  return {};
}

ParameterProblem phase_problem(std::span<const Volume> volumes, const BlendPhase& p) {
  return boundless(volumes, "weight", p.weight);
}

int nesting_of(std::span<const Volume> volumes, VolumeIndex i) {
  int deepest = 0;
  for (const Part& part : parts_of(volumes[i.value]))
    deepest = std::max(deepest, nesting_of(volumes, part.volume));
  return deepest + 1;
}

bool nested_too_deep(std::span<const Volume> volumes) {
  // Each pass finds the depths that are one larger than those that the pass before found
  std::vector<int> depth(volumes.size(), 1);
  for (bool changed = true; changed;) {
    changed = false;
    for (std::size_t i = 0; i < volumes.size(); ++i) {
      int d = 1;
      for (const Part& part : parts_of(volumes[i])) d = std::max(d, depth[part.volume.value] + 1);
      if (d > kMaxVolumeNesting) return true;
      changed |= std::exchange(depth[i], d) != d;
    }
  }
  return false;
}

}  // namespace ls::scene
