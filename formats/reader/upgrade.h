// Upgrades files of Mitsuba 0.5 and 0.6, and of other programs with the same format, to Mitsuba 3: camelCase
// names, renamed parameters, values with other meanings, other defaults. Later stages have to handle only the
// format of Mitsuba 3; where that is not enough, they check Element::old.
#pragma once

#include <span>
#include <string>
#include <string_view>

#include "formats/xml/document.h"

namespace ls::scene {

// True if `version` is that of an old file ("0.5.0", but not "3.0.0").
bool is_old_version(std::string_view version);

// Upgrades an element, whose children have been upgraded already, and marks it as old. Leaves everything
// unknown unchanged; the reader of the element reports it.
void upgrade(Element& e);

// Converts names from camelCase: maxDepth to max_depth, intIOR to int_ior.
std::string snake_case(std::string_view name);

// A parameter whose new name is not just the old one in snake_case; also used for the documentation.
struct Renamed {
  std::string_view tag, plugin, before, now;
};
std::span<const Renamed> renamed_parameters();

}  // namespace ls::scene
