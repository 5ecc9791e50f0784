#include "core/base/light/light_group.h"

#include <fmt/format.h>

#include <algorithm>

#include "core/base/safe_text.h"

namespace ls {

std::string wrong_light_group(std::string_view name) {
  const auto fits = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' || c == '-';
  };
  if (!name.empty() && name.size() <= kMostLightGroupBytes && std::ranges::all_of(name, fits)) return {};
  return fmt::format("a light group's name has 1 to {} ASCII letters, digits, '_' and '-', not \"{}\"",
                     kMostLightGroupBytes, plain_text(name.substr(0, kMostLightGroupBytes)));
}

}  // namespace ls
