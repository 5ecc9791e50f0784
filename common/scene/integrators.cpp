#include "common/scene/integrators.h"

#include <algorithm>
#include <iterator>

namespace ls::scene {
namespace {

constexpr IntegratorRow kRows[] = {
    {"volpath", "volpath", {}},        {"volpathmis", "volpath", {}}, {"volpath_distant_mis", "volpath", {}},
    {"volpath_simple", "volpath", {}}, {"path", "path", {}},          {"direct", "path", 2},
    {"ptracer", "path", {}},
};

}  // namespace

std::span<const IntegratorRow> integrators() { return kRows; }

const IntegratorRow* integrator_row(std::string_view name) {
  const auto it = std::find_if(std::begin(kRows), std::end(kRows),
                               [&](const IntegratorRow& r) { return r.name == name; });
  return it == std::end(kRows) ? nullptr : it;
}

}  // namespace ls::scene
