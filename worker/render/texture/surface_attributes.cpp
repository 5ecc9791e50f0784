#include "worker/render/texture/surface_attributes.h"

namespace ls::render {

void SurfaceAttributes::find_means() {
  std::vector<V3d> sums(names.size(), V3d(0, 0, 0));
  std::vector<double> counts(names.size(), 0);
  for (std::uint32_t i : first_of)
    for (; i != kNoChannel; i = channels[i].next) {
      const Channel& c = channels[i];
      for (std::uint32_t k = 0; k < c.count; ++k) sums[c.name] += V3d(values[c.first + k]);
      counts[c.name] += c.count;
    }
  for (std::size_t i = 0; i < sums.size(); ++i)
    means.push_back(counts[i] > 0 ? C3(sums[i] / counts[i]) : C3(0));
}

}  // namespace ls::render
