#pragma once

#include "common/scene/xml/document.h"

namespace ls::scene {

// Reports that the object's type is unsupported or unknown. The message for an unknown type has a suggestion.
void unknown_plugin(const Element& e, Report& report);

}  // namespace ls::scene
