// Grids whose density differs between channels (files with three channels): the free flight, transmittance
// and passage functions of medium.h.
//
// Each channel has its own local majorant; the hero's decides the tentative collisions and their type. The
// density that another channel's majorants would have given the same collisions goes into the flight's
// `density`: the transmittance of that majorant, times its probability of null collisions. Dividing by the
// mean of these is the balance heuristic over channels, which keeps weights below 3 where the quotients are
// unbounded.
#pragma once

#include "worker/render/media/medium.h"

namespace ls::render {

// Densities of the channels at index coordinates inside the domain of m.by_channel (or m.density).
C3 densities(const Medium& m, const V3& index);

// passed() of medium.h, for these grids.
Flight passed_channels(const Medium& m, int hero, const V3& o, const V3& d, float t);

}  // namespace ls::render
