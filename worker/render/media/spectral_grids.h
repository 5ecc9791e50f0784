// The functions of medium.h (free flight, transmittance and passed()) for grids whose density differs between
// channels, that is, from files with three channels.
//
// Each channel has its own local majorant. The majorant of the hero (the channel that decides distances:
// medium.h) determines the tentative collisions and their type. For every other channel, the density with
// which its majorants would give the same collisions goes into the flight's `density`: the transmittance of
// its majorant, times its probabilities of null collisions. Dividing by the mean of these is the balance
// heuristic over channels, which keeps weights below 3 where the quotients are unbounded.
#pragma once

#include "worker/render/media/medium.h"

namespace ls::render {

// Returns the densities of the three channels at index coordinates inside the domain of m.by_channel or, if
// this is null, of m.density.
C3 densities(const Medium& m, const V3& index);

// The function passed() of medium.h for grids with a density per channel.
Flight passed_channels(const Medium& m, int hero, const V3& o, const V3& d, float t);

}  // namespace ls::render
