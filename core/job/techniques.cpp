#include "core/job/techniques.h"

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>

namespace ls {
namespace {

constexpr std::array kRows{
    TechniqueRow{Technique::equiangular, "equiangular",
                 "looks for light near lamps along whole ways through media"},
    TechniqueRow{Technique::exponential, "exponential",
                 "looks for light along whole ways through media, as it fades"},
    TechniqueRow{Technique::camera_points, "camera_points",
                 "looks for light at several points of the camera rays' ways through media"},
    TechniqueRow{Technique::lamp_directions, "lamp_directions",
                 "sends a share of all directions close to lights without extent"},
    TechniqueRow{Technique::lamp_flights, "lamp_flights",
                 "ends a share of all flights through media close to lights without extent"},
    TechniqueRow{Technique::light_vertices, "light_vertices", "connects paths to points that the sun lights"},
    TechniqueRow{Technique::light_tree, "light_tree", "chooses among many lights by a tree"},
    TechniqueRow{Technique::path_reuse, "path_reuse",
                 "lets paths serve several pixels from their second scattering on"},
    TechniqueRow{Technique::shadow_roulette, "shadow_roulette",
                 "traces shadow rays through grids at random where they could bring little"},
    TechniqueRow{Technique::sky_samples, "sky_samples",
                 "looks for a sky of one radiance in a second direction from the first surface"},
    TechniqueRow{Technique::path_splitting, "path_splitting",
                 "splits paths at their first scattering in a grid, and ends those that could bring little"},
    TechniqueRow{Technique::sky_portals, "sky_portals",
                 "looks for the sky through the openings by which its light enters"},
    TechniqueRow{Technique::local_lights, "local_lights",
                 "chooses lights by which of them reach the place that is lit"},
    TechniqueRow{Technique::emissive_grids, "emissive_grids",
                 "looks for the light of emissive grids, such as fire"}};

constexpr bool in_order() {
  for (std::size_t i = 0; i < kRows.size(); ++i)
    if (static_cast<std::size_t>(kRows[i].technique) != i) return false;
  return true;
}
static_assert(in_order());

}  // namespace

std::span<const TechniqueRow> techniques() { return kRows; }

TechniqueSwitch off_switch(Technique technique, std::string_view integrator) {
  if (technique == Technique::equiangular && integrator == "volpath_distant_mis")
    return {"distance", "exponential"};
  if (technique == Technique::exponential) return {"distance", "equiangular"};
  if (technique == Technique::lamp_directions) return {"phase_only", "true"};
  return {kRows[static_cast<std::size_t>(technique)].name,
          // Each of the remaining techniques has a parameter with its own name; the value -1 switches it off.
          "-1"};
}

TechniqueSet TechniqueSet::of_bits(std::uint32_t bits) {
  TechniqueSet set;
  set.bits_ = bits & ((1u << kRows.size()) - 1);
  return set;
}

std::string techniques_json(TechniqueSet set, std::string_view integrator) {
  nlohmann::json list = nlohmann::json::array();
  for (const TechniqueRow& row : kRows) {
    if (!set.has(row.technique)) continue;
    const TechniqueSwitch off = off_switch(row.technique, integrator);
    list.push_back({{"name", row.name},
                    {"what", row.what},
                    {"off", {{"parameter", off.parameter}, {"value", off.value}}}});
  }
  return list.dump();
}

std::string technique_names() {
  std::string names;
  for (const TechniqueRow& row : kRows) names.append(names.empty() ? "" : ", ").append(row.name);
  return names;
}

std::string to_string(const TechniqueChoice& choice) {
  std::string text;
  for (const TechniqueRow& row : kRows) {
    const bool with = choice.with.has(row.technique);
    if (!with && !choice.without.has(row.technique)) continue;
    text.append(text.empty() ? "" : ",").append(with ? "+" : "-").append(row.name);
  }
  return text;
}

std::optional<TechniqueChoice> parse_technique_choice(std::string_view text) {
  TechniqueChoice choice;
  while (true) {
    const std::string_view word = text.substr(0, text.find(','));
    const auto* const row = std::find_if(kRows.begin(), kRows.end(), [&](const TechniqueRow& r) {
      return !word.empty() && r.name == word.substr(1);
    });
    if (row == kRows.end() || (word[0] != '+' && word[0] != '-')) return std::nullopt;
    if (choice.with.has(row->technique) || choice.without.has(row->technique)) return std::nullopt;
    (word[0] == '+' ? choice.with : choice.without).add(row->technique);
    if (word.size() == text.size()) break;
    text.remove_prefix(word.size() + 1);
  }
  if (choice.without.has(Technique::equiangular) && choice.without.has(Technique::exponential))
    return std::nullopt;
  return choice;
}

IntegratorSettings with_choice(IntegratorSettings integrator, const TechniqueChoice& choice) {
  // The parameter of a technique, and the value by which the technique is used wherever that is possible.
  struct Parameter {
    Technique technique;
    int IntegratorSettings::*value;
    int with;
  };
  using enum Technique;
  constexpr int kOff = -1, kChosenForTheScene = 0, kAlways = 1;
  constexpr std::array kParameters{
      Parameter{equiangular, &IntegratorSettings::equiangular, kChosenForTheScene},
      Parameter{camera_points, &IntegratorSettings::camera_points, kChosenForTheScene},
      Parameter{lamp_flights, &IntegratorSettings::lamp_flights, kChosenForTheScene},
      Parameter{light_vertices, &IntegratorSettings::light_vertices, kAlways},
      Parameter{light_tree, &IntegratorSettings::light_tree, kChosenForTheScene},
      Parameter{path_reuse, &IntegratorSettings::path_reuse, kUsualPathReuse},
      Parameter{shadow_roulette, &IntegratorSettings::shadow_roulette, kChosenForTheScene},
      Parameter{sky_samples, &IntegratorSettings::sky_samples, kChosenForTheScene},
      Parameter{path_splitting, &IntegratorSettings::path_splitting, kChosenForTheScene},
      Parameter{sky_portals, &IntegratorSettings::sky_portals, kAlways},
      Parameter{local_lights, &IntegratorSettings::local_lights, kAlways},
      Parameter{emissive_grids, &IntegratorSettings::emissive_grids, kAlways}};
  for (const Parameter& p : kParameters) {
    if (choice.with.has(p.technique)) integrator.*p.value = p.with;
    if (choice.without.has(p.technique)) integrator.*p.value = kOff;
  }
  if (choice.with.has(lamp_directions)) integrator.phase_only = false;
  if (choice.without.has(lamp_directions)) integrator.phase_only = true;
  if (choice.with.has(equiangular) || choice.with.has(exponential))
    integrator.distance = DistanceSampling::mis;
  if (choice.without.has(equiangular)) integrator.distance = DistanceSampling::exponential;
  if (choice.without.has(exponential)) integrator.distance = DistanceSampling::equiangular;
  return integrator;
}

}  // namespace ls
