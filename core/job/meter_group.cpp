#include "core/job/meter_group.h"

#include <fmt/format.h>

namespace ls {

std::string MeterGroup::name_of(std::uint32_t i) const {
  return count > 1 ? fmt::format("{}[{}]", name, i + 1) : name;
}

std::vector<MeterGroup> meter_groups(const Scene& scene) {
  std::vector<MeterGroup> groups;
  for (const Meter& m : scene.meters)
    groups.push_back({m.name, m.kind, static_cast<std::uint32_t>(m.count())});
  return groups;
}

}  // namespace ls
