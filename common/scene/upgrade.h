// Files of Mitsuba 0.5 and 0.6, and of other programs that read these, in the words of Mitsuba 3: names in
// camelCase, parameters that were called otherwise, values that were understood otherwise, defaults that
// were others. What follows the upgrade knows one dialect; where even that does not do, Element::old tells.
#pragma once

#include <span>
#include <string>
#include <string_view>

#include "common/scene/document.h"

namespace ls::scene {

// Whether this is the version of such a file ("0.5.0", but not "3.0.0").
bool is_old_version(std::string_view version);

// Rewrites an element, whose children have been rewritten before it, and marks it as old. What it can't make
// sense of it leaves, so that it is reported where it is read.
void upgrade(Element& e);

// maxDepth -> max_depth, intIOR -> int_ior.
std::string snake_case(std::string_view name);

// Parameters whose new names are others than their old ones in snake_case; for the documentation, too.
struct Renamed {
  std::string_view tag, plugin, before, now;
};
std::span<const Renamed> renamed_parameters();

}  // namespace ls::scene
