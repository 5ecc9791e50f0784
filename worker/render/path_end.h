// Where paths end that nothing else ends.
#pragma once

namespace ls::render {

// Rays of one path, and null boundaries on the way of one shadow ray: what has more is cut off there, counted
// as a rejected sample. Paths that roulette must end (below) reach it with a probability of e^-60.
inline constexpr int kMaxSegments = 1 << 20;
inline constexpr int kMaxShadowSegments = 1 << 16;
// Beyond this depth roulette may end even paths that lost nothing: a closed white room has no other end. A
// share of 1024 / n of them reaches n scatterings, so that weights grow slower than any exponential: after n
// scatterings in a white slab of optical depth tau a share exp(-n pi^2 / (3 (tau + 1.42)^2)) is still inside,
// and a constant survival q has a finite variance only where 1 - q is less than that rate. From the second
// depth on q is constant, for the longest paths of a white room would have no mean: finite up to tau = 230. A
// path there has 5500 vertices in the mean.
inline constexpr int kForcedRouletteDepth = 1024;
inline constexpr int kLastRouletteDepth = 1 << 16;
inline constexpr float kLastSurvival = 1 - 0x1p-14f;
constexpr float forced_survival(int depth) {
  if (depth < kForcedRouletteDepth) return 1;
  if (depth >= kLastRouletteDepth) return kLastSurvival;
  return static_cast<float>(depth) / static_cast<float>(depth + 1);
}

}  // namespace ls::render
