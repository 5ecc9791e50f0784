// Grids whose density differs between channels (files of three channels): flights, transmittances and what
// passes, as of other media (medium.h).
//
// Each channel has its own local majorant; the hero's decides where tentative collisions are, and of what
// sort. What the same collisions would have had as density under another channel's majorants goes into the
// flight's `density`: T of its majorant, times its share of null collisions. Dividing by the mean of these
// is the balance heuristic over channels, which keeps weights below 3 where the quotients are without bound.
#pragma once

#include "worker/render/medium.h"

namespace ls::render {

// Of the channels, at index coordinates inside of the domain of m.by_channel (or m.density).
C3 densities(const Medium& m, const V3& index);

// As `passed` of medium.h.
Flight passed_channels(const Medium& m, int hero, const V3& o, const V3& d, float t);

}  // namespace ls::render
