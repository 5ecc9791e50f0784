#pragma once

#include "common/scene/xml/document.h"

namespace ls::scene {

// Reports that the object's type cannot be read: it is unsupported, or unknown, and then the message has a
// suggestion.
void unknown_plugin(const Element& e, Report& report);

}  // namespace ls::scene
