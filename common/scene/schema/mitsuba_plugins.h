// Every plugin of Mitsuba's scene language by name: whether it is read here and, if not, why. Messages,
// suggestions and docs/reference/mitsuba.md use this one table. Kinds of objects that Mitsuba does not have
// are added to it from the table of the scene language (describe.h).
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace ls::scene {

enum class Standing { read, in_part, refused };
enum class Origin {
  mitsuba3,  // of version 3.9
  older,     // of an earlier version only
  ours
};

struct PluginRow {
  std::string_view tag, name;
  Standing standing;
  // Read: the plugin it becomes, if the name differs. Read in part: what is left out. Refused: the reason,
  // and what to use instead.
  std::string_view note;
  Origin origin = Origin::mitsuba3;
};

std::span<const PluginRow> mitsuba_plugins();
const PluginRow* plugin_row(std::string_view tag, std::string_view name);  // nullptr: unknown
bool is_read_plugin(std::string_view tag, std::string_view name);
std::vector<std::string> read_plugins(std::string_view tag);  // names

}  // namespace ls::scene
