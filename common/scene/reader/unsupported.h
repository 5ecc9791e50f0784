// Parts of the dialect that are not supported: parameters that have no effect here, and plugins.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace ls::scene {

// Returns why a parameter of the dialect (Mitsuba's scene format) has no effect here; empty for all other
// parameters.
std::string_view meaningless_because(std::string_view tag, std::string_view plugin,
                                     std::string_view parameter);
std::vector<std::string> meaningless_parameters(std::string_view tag, std::string_view plugin);

// Returns what to write instead of a parameter of an older or related dialect; empty for all other
// parameters.
std::string_view replacement(std::string_view tag, std::string_view parameter);

// The dialect's plugins of a tag: those that this program can read, and the others.
const std::vector<std::string>& supported_plugins(std::string_view tag);
const std::vector<std::string>& unsupported_plugins(std::string_view tag);
bool is_supported_plugin(std::string_view tag, std::string_view plugin);
bool is_unsupported_plugin(std::string_view tag, std::string_view plugin);

struct MeaninglessRow {
  std::string_view tag, plugin;  // plugin "": all plugins of this tag
  std::vector<std::string> parameters;
  std::string_view because;
};
const std::vector<MeaninglessRow>& meaningless_table();  // used for the documentation

}  // namespace ls::scene
