#include "worker/render/integrator/sharing_block.h"

namespace ls::render {

void share_tails(const IntegratorSettings& settings, World& w) {
  Features need = w.need;
  need.split = false;
  need.reuse = true;
  // Grids have no density of flights in closed form; lamps in media, light vertices and points on segments
  // change how directions are sampled; lights without a position are weighted one by one where rays end.
  if (settings.path_reuse < 2 || !reuse_variants().back().covers.covers(need)) return;
  if (w.lights.any_without_place() || w.null_transmission || !w.depth_allows(2)) return;
  // Roulette at the first vertex would be a part of the densities
  if (w.rr_depth < 2 || (w.passing_counts && w.need.passing)) return;
  for (const SurfaceInfo& s : w.geometry.surfaces)
    // Rays from two sides may find different media behind an open boundary. A null surface that emits light
    // is one of several such on a path.
    if ((s.transition && s.sheet) || (s.null && s.light != kNone)) return;
  w.reuse = settings.path_reuse;
  w.need.reuse = true;
}

}  // namespace ls::render
