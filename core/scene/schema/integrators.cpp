#include "core/scene/schema/integrators.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>

namespace ls::scene {
namespace {

// The default max_depth of Mitsuba 3's differentiable integrators; all other integrators have -1 (no limit).
constexpr int kDifferentiated = 6;

constexpr IntegratorRow kIntegrators[] = {
    {"volpath", "volpath", {}},
    {"volpathmis", "volpath", {}},
    {kDistantMis, kDistantMis, {}},
    {"volpath_simple", "volpath", {}},
    {"path", "path", {}},
    {"direct", "path", 2},
    {kWhitted, kWhitted, {}},
    {"ptracer", "path", {}},
    {"prb", "path", {}, true, kDifferentiated},
    {"prb_basic", "path", {}, true, kDifferentiated},
    {"prb_projective", "path", {}, true, kDifferentiated},
    {"prbvolpath", "volpath", {}, true, kDifferentiated},
    {"direct_projective", "path", 2, true},
    {"bdpt", "volpath", {}, true},
    {"erpt", "volpath", {}, true},
    {"mlt", "volpath", {}, true},
    {"photonmapper", "volpath", {}, true},
    {"ppm", "volpath", {}, true},
    {"pssmlt", "volpath", {}, true},
    {"sppm", "volpath", {}, true},
    {"vpl", "volpath", {}, true},
};

constexpr WrapperRow kWrappers[] = {
    {"moment", "the variances are not written"},
    {"aov", "it asks for no extra channels"},
    {"adaptive", "how many samples a pixel gets is decided by --target-error"},
    {"irrcache", "nothing is interpolated"},
};

template <class Rows>
auto* row_of(const Rows& rows, std::string_view name) {
  const auto it =
      std::find_if(std::begin(rows), std::end(rows), [&](const auto& r) { return r.name == name; });
  return it == std::end(rows) ? nullptr : &*it;
}

}  // namespace

std::span<const IntegratorRow> integrators() { return kIntegrators; }
const IntegratorRow* integrator_row(std::string_view name) { return row_of(kIntegrators, name); }

bool sees_media(std::string_view name) {
  const auto sees = [](std::string_view ours) { return ours != "path" && ours != kWhitted; };
  const IntegratorRow* row = integrator_row(name);
  return sees(row ? row->ours : name);
}

std::span<const WrapperRow> integrator_wrappers() { return kWrappers; }
const WrapperRow* wrapper_row(std::string_view name) { return row_of(kWrappers, name); }

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
