// The functions of medium.h (free flight, transmittance and passed()) for grids whose density differs between
// channels, that is, from files with three channels.
//
// Each channel has local majorants of its own. Those of the hero (the channel that decides distances:
// medium.h) determine the tentative collisions and their type. The `density` of another channel is the
// density with which the majorants of that channel would have given the same collisions: their transmittance
// times the null-collision coefficients (majorant - density), relative to the same product of the hero.
// Dividing by the mean over channels is the balance heuristic. It keeps weights below 3, whereas the ratios
// alone are unbounded.
#pragma once

#include "worker/render/media/medium.h"

namespace ls::render {

// Returns the densities of the three channels at index coordinates inside the domain of m.by_channel or, if
// this is null, of m.density.
C3 densities(const Medium& m, const V3& index);

// The function passed() of medium.h for grids with a density per channel.
Flight passed_channels(const Medium& m, int hero, const V3& o, const V3& d, float t);

}  // namespace ls::render
