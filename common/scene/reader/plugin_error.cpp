#include "common/scene/reader/plugin_error.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "common/base/suggest.h"
#include "common/scene/reader/unsupported.h"
#include "common/scene/xml/transform_element.h"

namespace ls::scene {

void unknown_plugin(const Element& e, Report& report) {
  const std::string_view type = e.get("type");
  const auto& supported = supported_plugins(e.tag);
  if (is_unsupported_plugin(e.tag, type)) {
    report.error(value_place(e, "type"), fmt::format("the {} \"{}\" is not supported; supported: {}", e.tag,
                                                     type, fmt::join(supported, ", ")));
    return;
  }
  report.error(value_place(e, "type"),
               fmt::format("there is no {} \"{}\"{}", e.tag, type, suggestion(type, supported)));
}

}  // namespace ls::scene
