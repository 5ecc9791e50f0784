// Part of path.h, which includes it: light given off by a medium on the way.
#pragma once

#include "worker/render/counters.h"
#include "worker/render/glow.h"
#include "worker/render/world.h"

namespace ls::render {

// All that the segment ahead gives off towards the path, wherever its flight will end: what the flight then
// finds at its end comes on top of it. Like a light that is hit, it counts at the depth of the path so far.
template <Features F, template <Features> class Light>
void PathTracer<F, Light>::add_glow(const Medium& medium, float t_max) {
  if (medium.glow == Glow::none || (depth_ == 0 && world_.hide_emitters)) return;
  LS_COUNT(glow);
  const C3 light = medium.grid
                       ? glow_of_grid(medium, start_, d_, t_max, stream_.stream(segment_, Purpose::emission))
                       : glow_of_length(medium, t_max);
  if (!is_black(light)) add(beta_ * light);
}

}  // namespace ls::render
