// One job of a coverage scene.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/image/error/error_estimate.h"
#include "core/scene/scene.h"
#include "tests/coverage/scenes.h"

namespace ls::test {

struct CoverageJob {
  std::vector<double> image;  // interleaved R, G, B
  ImageError error;           // as the job says it
  bool heavy_tail = false;
  // Of the halves A and B, planar, as the film has them: at the end, and before the last round. Of jobs of 32
  // x 32 pixels alone.
  std::array<std::vector<double>, 2> halves, earlier;
  std::uint64_t spp = 0, earlier_spp = 0;
};

// 32 x 32 pixels, rendered and folded round by round as the coordinator does.
CoverageJob run_plain_job(const Scene& scene, std::uint64_t spp, std::uint64_t seed);

// 64 x 64 pixels with a target error: a whole `lightshaft render`, whose tiles stop when they are good
// enough.
CoverageJob run_adaptive_job(const CoverageScene& scene, std::uint64_t seed);
// The same image, every pixel with `spp` samples: no estimate has a say in what is in it.
CoverageJob run_uniform_job(const CoverageScene& scene, std::uint64_t spp, std::uint64_t seed);

}  // namespace ls::test
