#include "worker/render/media/medium.h"

#include "worker/render/media/spectral_grids.h"

namespace ls::render {

Flight passed(const Medium& m, int hero, const V3& o, const V3& d, float t) {
  if (m.by_channel[0]) return passed_channels(m, hero, o, d, t);
  double depth = t;
  if (m.grid) {
    depth = 0;
    for (CellWalk w(*m.density, o, d, 0, t); w.next();)
      if (w.cell().hi > 0) depth += m.density->pass(w.origin(), w.direction(), w.begin(), w.end()).integral;
  }
  Flight f;
  f.t = t;
  for (int c = 0; c < 3; ++c)
    f.weight[c] = f.density[c] =
        detail::transmittance_ratio(m.sigma_t[c], m.sigma_t[hero], static_cast<float>(depth));
  return f;
}

}  // namespace ls::render
