// When paths end: the hard limits, and Russian roulette for paths that lose no energy.
#pragma once

namespace ls::render {

// The largest numbers of rays of one path and of surfaces on one shadow ray. A sample that exceeds either is
// rejected and counted. Paths subject to forced roulette (below) reach the limit with probability e^-60.
inline constexpr int kMaxSegments = 1 << 20;
inline constexpr int kMaxShadowSegments = 1 << 16;
// From kForcedRouletteDepth scatterings on, roulette may end even paths that lose no energy; otherwise
// nothing would end a path in a closed white room. After n scatterings the survival probability is n / (n +
// 1), so a share of 1024 / n of these paths reaches n scatterings, and weights grow only linearly. A constant
// survival probability q would have infinite variance in dense media: in a white slab of optical depth tau, a
// share exp(-n pi^2 / (3 (tau + 1.42)^2)) of the light is still inside after n scatterings, and the variance
// is finite only where 1 - q is below the rate of this decay, pi^2 / (3 (tau + 1.42)^2). Beyond
// kLastRouletteDepth q is constant, as otherwise the length of paths in a white room would have no mean; the
// variance is then finite up to tau = 230, where a path has 5500 vertices on average.
inline constexpr int kForcedRouletteDepth = 1024;
inline constexpr int kLastRouletteDepth = 1 << 16;
inline constexpr float kLastSurvival = 1 - 0x1p-14f;
// In media that lose no light, light subpaths would be so long that their vertices fill the memory. So from
// kMostUnforced scatterings on, a light subpath survives each scattering with probability kForcedLight at
// most.
inline constexpr int kMostUnforced = 8;
inline constexpr float kForcedLight = .5f;
constexpr float forced_survival(int depth) {
  if (depth < kForcedRouletteDepth) return 1;
  if (depth >= kLastRouletteDepth) return kLastSurvival;
  return static_cast<float>(depth) / static_cast<float>(depth + 1);
}

}  // namespace ls::render
