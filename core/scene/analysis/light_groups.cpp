#include "core/scene/analysis/light_groups.h"

#include <set>
#include <string_view>
#include <variant>

#include "core/base/light_group.h"

namespace ls::scene {

bool gives_off_light(const Medium& medium) {
  constexpr Rgb kBlack{0, 0, 0};
  if (const auto* m = std::get_if<HomogeneousMedium>(&medium))
    return m->emission != kBlack || m->source_radiance != kBlack;
  const auto& m = std::get<HeterogeneousMedium>(medium);
  return m.emission || m.source_radiance || m.temperature;
}

std::vector<std::string> light_groups_of(const Scene& scene) {
  std::set<std::string_view> names;
  const auto add = [&](const std::string& group) {
    names.insert(group.empty() ? kOtherLightGroup : std::string_view(group));
  };
  for (const Shape& s : scene.shapes)
    if (s.emitter) add(s.emitter->light_group);
  for (const Emitter& e : scene.emitters) std::visit([&](const auto& light) { add(light.light_group); }, e);
  for (const Medium& m : scene.media)
    if (gives_off_light(m)) std::visit([&](const auto& medium) { add(medium.light_group); }, m);
  if (names.empty()) names.insert(kOtherLightGroup);
  return {names.begin(), names.end()};
}

}  // namespace ls::scene
