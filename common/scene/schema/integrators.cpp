#include "common/scene/schema/integrators.h"

#include <algorithm>

#include <iterator>

#include "common/scene/schema/nori_words.h"

namespace ls::scene {
namespace {

constexpr IntegratorRow kIntegrators[] = {
    {"volpath", "volpath", {}},
    {"volpathmis", "volpath", {}},
    {kDistantMis, kDistantMis, {}},
    {"volpath_simple", "volpath", {}},
    {"path", "path", {}},
    {"direct", "path", 2},
    {"ptracer", "path", {}},
    {"prb", "path", {}, true},
    {"prb_basic", "path", {}, true},
    {"prbvolpath", "volpath", {}, true},
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
  if (const IntegratorRow* row = integrator_row(name)) return row->ours != "path";
  const nori::IntegratorRow* row = nori::integrator_row(name);
  return !row || row->ours != "path";
}

std::span<const WrapperRow> integrator_wrappers() { return kWrappers; }
const WrapperRow* wrapper_row(std::string_view name) { return row_of(kWrappers, name); }

}  // namespace ls::scene
