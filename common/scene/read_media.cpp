// Volumes, phase functions and media.
#include <fmt/format.h>

#include "common/scene/plugin_error.h"
#include "common/scene/reader.h"
#include "common/scene/transform.h"

namespace ls::scene {

std::optional<VolumeIndex> Reader::read_volume(const Element& e) {
  const std::string_view type = e.get("type");
  Params p(*this, e);
  if (type == "constvolume") {
    ConstVolume volume;
    bind(p, volume);
    scene_.volumes.emplace_back(volume);
  } else if (type == "gridvolume") {
    GridVolume volume;
    bind(p, volume);
    if (const auto name = p.take_string("gridname")) volume.grid_name = *name;
    if (!invertible(volume.to_world))
      report_.error(e.at,
                    "to_world flattens this volume or leaves the range of numbers: it can't be inverted");
    scene_.volumes.emplace_back(volume);
  } else {
    unknown_plugin(e, report_);
    return std::nullopt;
  }
  p.finish();
  return VolumeIndex{static_cast<std::uint32_t>(scene_.volumes.size() - 1)};
}

std::optional<PhaseIndex> Reader::read_phase(const Element& e) {
  const std::string_view type = e.get("type");
  Params p(*this, e);
  if (type == "isotropic") {
    scene_.phases.emplace_back(IsotropicPhase{});
  } else if (type == "hg") {
    HgPhase hg;
    bind(p, hg);
    scene_.phases.emplace_back(hg);
  } else {
    unknown_plugin(e, report_);
    return std::nullopt;
  }
  p.finish();
  return PhaseIndex{static_cast<std::uint32_t>(scene_.phases.size() - 1)};
}

std::optional<MediumIndex> Reader::read_medium(const Element& e) {
  if (e.get("type") == "homogeneous") return read_any_medium<HomogeneousMedium>(e);
  if (e.get("type") == "heterogeneous") return read_any_medium<HeterogeneousMedium>(e);
  unknown_plugin(e, report_);
  return std::nullopt;
}

template <class T>
std::optional<MediumIndex> Reader::read_any_medium(const Element& e) {
  Params p(*this, e);
  T medium;
  bind(p, medium);
  const auto phases = p.take_nested("phase");
  if (phases.size() > 1)
    report_.error(phases[1].use->at, fmt::format("{} has a second phase function", p.title()));
  p.finish();
  if (phases.empty()) {
    scene_.phases.emplace_back(IsotropicPhase{});
    medium.phase = {static_cast<std::uint32_t>(scene_.phases.size() - 1)};
  } else if (const auto index = phase(*phases[0].object, *phases[0].use)) {
    medium.phase = *index;
  }
  scene_.media.emplace_back(medium);
  return MediumIndex{static_cast<std::uint32_t>(scene_.media.size() - 1)};
}

}  // namespace ls::scene
