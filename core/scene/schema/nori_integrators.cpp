#include "core/scene/schema/nori_integrators.h"

namespace ls::scene::nori {
namespace {

constexpr IntegratorRow kIntegrators[] = {
    {"volpath_distant_mis", "volpath_distant_mis", {}},
    {"volpath", "volpath", {}},
    {"vol_path", "volpath", {}},
    {"volpath_mis", "volpath", {}},
    {"vol_path_mats", "volpath", {}},
    {"vol_path_ems", "volpath", {}},
    {"vol_path_mis", "volpath", {}},
    {"path", "path", {}},
    {"path_mats", "path", {}},
    {"path_ems", "path", {}},
    {"path_mis", "path", {}},
    {"direct", "path", 2},
    {"direct_mats", "path", 2},
    {"direct_ems", "path", 2},
    {"direct_mis", "path", 2},
    {"whitted", "whitted", {}},
    {"photonmapper", "path", {}, "light is computed without the blur of photon maps"},
    {"progressive_photonmapper", "path", {}, "light is computed without the blur of photon maps"},
};

}  // namespace

std::span<const IntegratorRow> integrators() { return kIntegrators; }

const IntegratorRow* integrator_row(std::string_view name) {
  for (const IntegratorRow& row : kIntegrators)
    if (row.name == name) return &row;
  return nullptr;
}

}  // namespace ls::scene::nori
