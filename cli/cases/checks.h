// Exact checks: of single values, of bits, and of what is refused.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "cli/cases/case.h"
#include "worker/render/render.h"

namespace ls::cases {

// The frame as it stands, rendered with `spp` samples a pixel.
struct Picture {
  FrameSize size;
  std::uint64_t spp = 0;
  std::vector<float> sums;  // six planes, of the two halves
  render::Health health;
  std::uint64_t clamped_inputs = 0;
  // Of a pixel and channel, over both halves.
  double mean(std::size_t pixel, std::size_t channel) const;
};
Result<Picture> shoot(const SceneKit& kit, std::uint64_t spp, const Bench& bench);

// What a case with this id asks of media (".../homogeneous...", ".../grid...") and what is left of them in a
// job: if nothing is, it asks nothing, and this says so.
std::optional<std::string> what_is_lost(const std::string& id, const SceneKit& kit);

// Of every pixel and channel the value that is farthest from the answer (as a share of it, where it is not
// 0).
Figure every_value(const Bench& bench, const SceneKit& kit, std::uint64_t spp, const Channels& expected,
                   double tolerance);

// How many of the sums of two scenes differ in a bit: 0.
Figure same_bits(const Bench& bench, const SceneKit& a, const SceneKit& b, std::uint64_t spp);

// 1 if the scene is refused with a message that has all of these in it.
Figure refused(const Bench& bench, const SceneKit& kit, const std::vector<std::string>& words);

}  // namespace ls::cases
