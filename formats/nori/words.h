// The vocabulary of scene files of Nori and its descendants: their objects (plugins) with parameters, and
// their integrators. The reader, its suggestions and docs/reference/scene-format.md use this one table.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/scene/schema/describe.h"
#include "core/scene/schema/nori_integrators.h"

namespace ls::scene::nori {

// The XML elements (<float>, <color>, ...) that may set a parameter, as bits that are combined.
enum Types : unsigned {
  kFloat = 1,
  kInteger = 2,
  kBoolean = 4,
  kString = 8,
  kColor = 16,
  kPoint = 32,
  kVector = 64,
  kTransform = 128,
  kTexture = 256,
  kVolume = 512,
  kBsdf = 1024
};
// Returns the names of the elements whose bits are set in `types`, such as "<float> or <color>".
std::string text_of(unsigned types);

struct Parameter {
  std::string_view name;
  unsigned types;
  std::string_view fallback;  // the default in words; "": the parameter is optional and has no default
  std::string_view meaning;
  Range range = kAny;          // allowed range of a number, or of each component of a colour or vector
  std::string_view idle = "";  // why the parameter has no effect here, for a warning; empty: it has an effect
};

struct Plugin {
  std::string_view tag, type;
  std::string_view becomes;  // the equivalent object of Mitsuba, in words
  std::vector<Parameter> parameters;
};
std::span<const Plugin> plugins();
const Plugin* find_plugin(std::string_view tag, std::string_view type);
std::vector<std::string> plugin_names(std::string_view tag);

// An object of Nori or its descendants that is rejected, and the reason.
struct Refused {
  std::string_view tag, type, because;
};
std::span<const Refused> refused_plugins();
// Returns why the object is rejected; empty: it is not in the table of rejected objects.
std::string_view refused_because(std::string_view tag, std::string_view type);

}  // namespace ls::scene::nori
