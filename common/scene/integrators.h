// The integrators by their names: what a scene may say, and --integrator.
#pragma once

#include <optional>
#include <span>
#include <string_view>

namespace ls::scene {

struct IntegratorRow {
  std::string_view name;         // the dialect's, or ours
  std::string_view ours;         // IntegratorSettings::name
  std::optional<int> max_depth;  // that the name implies
};

std::span<const IntegratorRow> integrators();
const IntegratorRow* integrator_row(std::string_view name);  // nullptr: there is none of that name

}  // namespace ls::scene
