// Small scenes for the question whether an image's error is what its estimate says.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace ls::test {

struct CoverageScene {
  std::string name;
  std::string xml;         // Mitsuba; its film has no say
  std::uint64_t spp = 64;  // at most, with a target
  bool fireflies = false;  // rare bright samples: what there is of an estimate is not to be trusted
  double target = 0;       // relMSE to stop at, tile by tile; 0: all samples everywhere
};

// Smooth and noisy, surfaces and media, light and dark; fireflies last.
const std::vector<CoverageScene>& coverage_scenes();

// A room with three lamps in the light groups key, fill and rim under a sky without a group; `fog`: with fog.
std::string mix_scene(bool fog);

}  // namespace ls::test
