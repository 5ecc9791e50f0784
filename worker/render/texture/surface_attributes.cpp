#include "worker/render/texture/surface_attributes.h"

namespace ls::render {

C3 SurfaceAttributes::mean(std::uint32_t name) const {
  V3d sum(0, 0, 0);
  double count = 0;
  for (std::size_t s = 0; s < surfaces; ++s) {
    const std::uint32_t i = channel_of[name * surfaces + s];
    if (i == kNoChannel) continue;
    const Channel& c = channels[i];
    for (std::uint32_t k = 0; k < c.count; ++k) sum += V3d(values[c.first + k]);
    count += c.count;
  }
  return count > 0 ? C3(sum / count) : C3(0);
}

}  // namespace ls::render
