// Names of the integrators of Nori and its descendants, which the option --integrator may also use.
#pragma once

#include <optional>
#include <span>
#include <string_view>

namespace ls::scene::nori {

struct IntegratorRow {
  std::string_view name;
  std::string_view ours;         // Lightshaft's integrator that renders it, as in IntegratorSettings::name
  std::optional<int> max_depth;  // maximum depth implied by the name; nullopt: none
  std::string_view but = "";     // how the image differs from Nori's, for a warning
};
std::span<const IntegratorRow> integrators();
const IntegratorRow* integrator_row(std::string_view name);

}  // namespace ls::scene::nori
