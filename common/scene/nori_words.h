// The words of Nori's scene files: its objects with their parameters, and its integrators. One table, which
// reading, suggestions and docs/reference/scene-format.md use.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/scene/describe.h"

namespace ls::scene::nori {

// What a parameter may be written as.
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
// Elements of these types, as "<float> or <color>".
std::string text_of(unsigned types);

struct Parameter {
  std::string_view name;
  unsigned types;
  std::string_view fallback;  // in words; "" and nothing else said: it may be left out
  std::string_view meaning;
  Range range = kAny;          // of a number, or of each component
  std::string_view idle = "";  // why it has no effect here: it is warned about
};

struct Plugin {
  std::string_view tag, type;
  std::string_view becomes;  // Mitsuba's object that means the same, in words
  std::vector<Parameter> parameters;
};
std::span<const Plugin> plugins();
const Plugin* find_plugin(std::string_view tag, std::string_view type);
std::vector<std::string> plugin_names(std::string_view tag);

// Objects that Nori or one of its descendants has and that are refused by name.
struct Refused {
  std::string_view tag, type, because;
};
std::span<const Refused> refused_plugins();
std::string_view refused_because(std::string_view tag, std::string_view type);  // empty: it is not

struct IntegratorRow {
  std::string_view name;
  std::string_view ours;         // IntegratorSettings::name
  std::optional<int> max_depth;  // that the name implies
  std::string_view but = "";     // in what the picture differs from Nori's: warned about
};
std::span<const IntegratorRow> integrators();
const IntegratorRow* integrator_row(std::string_view name);

// The section of docs/reference/scene-format.md.
std::string markdown();

}  // namespace ls::scene::nori
