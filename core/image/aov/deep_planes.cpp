#include "core/image/aov/deep_planes.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>

namespace ls {
namespace {

constexpr std::string_view kDeepPrefix = "deep.";

}  // namespace

std::vector<std::string> names_of_deep_planes(DeepSlices slices) {
  std::vector<std::string> names;
  for (std::size_t i = 0; i < DeepPlanes(slices).records(); ++i)
    for (const char letter : std::string_view(slices.colours ? "BEGRT" : "ET"))
      names.push_back(fmt::format("{}{:02}.{}", kDeepPrefix, i, letter));
  return names;
}

DeepSlices deep_slices_among(std::span<const std::string_view> names) {
  DeepSlices slices;
  std::uint32_t last = 0;
  bool any = false, colours = false;
  for (const std::string_view name : names) {
    if (!name.starts_with(kDeepPrefix)) continue;
    const std::string_view rest = name.substr(kDeepPrefix.size());
    if (rest.size() != 4 || !std::isdigit(static_cast<unsigned char>(rest[0])) ||
        !std::isdigit(static_cast<unsigned char>(rest[1])))
      continue;
    any = true;
    last = std::max(last, static_cast<std::uint32_t>((rest[0] - '0') * 10 + (rest[1] - '0')));
    colours = colours || rest[3] == 'R';
  }
  if (any) slices = {std::clamp(last, 1u, kMostDeepSlices), colours};
  return slices;
}

}  // namespace ls
