// Parameters of Mitsuba's scene format that have no effect in this program.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace ls::scene {

// Returns why a parameter of Mitsuba's format has no effect here; empty for all other parameters.
std::string_view meaningless_because(std::string_view tag, std::string_view plugin,
                                     std::string_view parameter);
std::vector<std::string> meaningless_parameters(std::string_view tag, std::string_view plugin);

// Returns what to write instead of a parameter of an older or related format; empty for all other parameters.
std::string_view replacement(std::string_view tag, std::string_view parameter);

struct MeaninglessRow {
  std::string_view tag, plugin;  // `plugin` "": the row holds for all plugins of this tag
  std::vector<std::string> parameters;
  std::string_view because;
};
const std::vector<MeaninglessRow>& meaningless_table();  // the whole table, for the documentation

}  // namespace ls::scene
