#include "common/scene/reader/plugin_error.h"

#include <fmt/format.h>

#include "common/base/suggest.h"
#include "common/scene/schema/mitsuba_plugins.h"
#include "common/scene/xml/transform_element.h"

namespace ls::scene {

void unknown_plugin(const Element& e, Report& report) {
  const std::string_view type = e.get("type");
  const PluginRow* row = plugin_row(e.tag, type);
  report.error(
      value_place(e, "type"),
      row ? fmt::format("the {} \"{}\" is not supported: {}", e.tag, type, row->note)
          : fmt::format("there is no {} \"{}\"{}", e.tag, type, suggestion(type, read_plugins(e.tag))));
}

}  // namespace ls::scene
