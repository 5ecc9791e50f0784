#include "common/scene/reader/aov_names.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>

namespace ls::scene {
namespace {

constexpr ChannelRow kChannels[] = {
    {"albedo", "albedo"},
    {"depth", "depth"},
    {"geo_normal", "geo_normal"},
    {"position", "position"},
    {"sh_normal", "normal"},
    {"uv", "uv"},
    {"shape_index", ""},
    {"prim_index", ""},
    {"boundary_test", ""},
    {"dp_du", ""},
    {"dp_dv", ""},
    {"duv_dx", ""},
    {"duv_dy", ""},
    {"coverage", "coverage", false},
    {"denoising_albedo", "denoising_albedo", false},
    {"denoising_normal", "denoising_normal", false},
    {"direct", "direct", false},
    {"emission", "emission", false},
    {"indirect", "indirect", false},
    {"material_id", "material_id", false},
    {"multiple", "multiple", false},
    {"shape_id", "shape_id", false},
    {"single", "single", false},
    {"surface", "surface", false},
    {"volume", "volume", false},
};

}  // namespace

std::span<const ChannelRow> channels() { return kChannels; }

const ChannelRow* channel_row(std::string_view theirs) {
  const auto* it = std::find_if(std::begin(kChannels), std::end(kChannels),
                                [&](const auto& r) { return r.theirs == theirs; });
  return it == std::end(kChannels) ? nullptr : it;
}

std::string mitsuba_channels(std::string_view aovs) {
  std::string out;
  while (!aovs.empty()) {
    const auto end = std::min(aovs.find(','), aovs.size());
    const std::string_view name = aovs.substr(0, end);
    aovs.remove_prefix(std::min(end + 1, aovs.size()));
    const auto* row = std::find_if(std::begin(kChannels), std::end(kChannels),
                                   [&](const auto& r) { return r.ours == name; });
    out +=
        fmt::format("{}{}:{}", out.empty() ? "" : ",", name, row == std::end(kChannels) ? name : row->theirs);
  }
  return out;
}

}  // namespace ls::scene
