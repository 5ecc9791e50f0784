// A table of all plugins (kinds of objects) of Mitsuba's scene language, by name: whether Lightshaft reads
// the plugin and, if not, why. Messages, suggestions and docs/reference/mitsuba.md use it. Plugins that only
// Lightshaft has are added from the table of the scene language (describe.h).
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace ls::scene {

enum class Standing { read, in_part, refused };
enum class Origin {
  mitsuba3,  // Mitsuba 3.9 has the plugin
  older,     // only earlier versions of Mitsuba have it
  ours
};

struct PluginRow {
  std::string_view tag, name;
  Standing standing;
  // Words whose meaning depends on `standing`. read: what the plugin becomes; empty: Lightshaft's plugin of
  // the same name. in_part: what is left out. refused: the reason, and what to use instead.
  std::string_view note;
  Origin origin = Origin::mitsuba3;
};

std::span<const PluginRow> mitsuba_plugins();
const PluginRow* plugin_row(std::string_view tag, std::string_view name);  // nullptr: unknown
bool is_read_plugin(std::string_view tag, std::string_view name);
std::vector<std::string> read_plugins(std::string_view tag);  // the names of the plugins that are read
// True if Mitsuba 3.9 has the plugin, but not this parameter of it, or reads no plugin of this name. Known
// for all parameters that write_xml() writes.
bool is_our_parameter(std::string_view tag, std::string_view plugin, std::string_view parameter);

}  // namespace ls::scene
